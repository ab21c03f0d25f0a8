"""SciPy's least squares, given the predictions and derivatives of a session, ends where the fit ends."""

import numpy as np
import pytest
from scipy.optimize import least_squares

import abbe


@pytest.fixture(scope="module")
def session():
    """Four tests with set-up priors whose parameters are all identifiable."""
    from conftest import SESSIONS

    plan = abbe.Session.read(SESSIONS / "hermle-c600u" / "chapter5.toml")
    return plan.simulate({"EX0C": 12.0, "EB0A": -2.0, "EY0A": 30.0}, seed=3, draw_setups=True)


def test_the_jacobian_is_the_derivative(session):
    fit = session.fit()
    at = fit.solution
    jacobian = session.jacobian(fit)
    assert jacobian.shape == (session.observed.size, len(session.parameters))
    for column in range(at.size):
        step = np.zeros(at.size)
        step[column] = 10.0
        difference = (session.predict(at + step) - session.predict(at - step)) / 20.0
        assert jacobian[:, column] == pytest.approx(difference, rel=1e-6, abs=1e-10)


def test_residuals_are_observed_less_predicted(session):
    fit = session.fit()
    difference = 1e3 * (session.observed - session.predict(fit))
    for test, rows in session.slices.items():
        assert fit.residuals[test] == pytest.approx(difference[rows], abs=1e-8)


def test_least_squares_ends_at_the_estimates(session):
    fit = session.fit()
    assert not any(fit.is_outlier[test].any() for test in session.tests)
    noise_mm = session.noise_um * 1e-3
    prior_u = np.array([np.inf if p.prior_u is None else p.prior_u for p in session.parameters])

    def residuals(values):
        return np.concatenate([(session.predict(values) - session.observed) / noise_mm, values / prior_u])

    def jacobian(values):
        return np.concatenate([session.jacobian(values) / noise_mm, np.diag(1 / prior_u)])

    tight = {"xtol": 1e-15, "ftol": 1e-15, "gtol": 1e-15}
    found = least_squares(residuals, np.zeros(prior_u.size), jacobian, method="trf", x_scale="jac", **tight)
    scale = np.maximum(np.abs(fit.solution), np.sqrt(np.diag(np.linalg.inv(found.jac.T @ found.jac))))
    assert np.max(np.abs(found.x - fit.solution) / scale) < 1e-9


def test_a_mapping_states_some_parameters(session):
    one = session.predict({"EX0C": 10.0})
    nominal = session.predict()
    values = np.zeros(len(session.parameters))
    values[[p.id for p in session.parameters].index("EX0C")] = 10.0
    assert np.array_equal(one, session.predict(values))
    assert not np.array_equal(one, nominal)
