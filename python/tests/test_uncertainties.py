"""Estimates as correlated numbers: what is computed with them has the uncertainty of simulated fits."""

import math
import sys

import numpy as np
import pytest

import abbe


def test_numbers_have_the_covariance_of_the_fit(chapter5):
    covariance_matrix = pytest.importorskip("uncertainties").covariance_matrix
    fit = chapter5.simulate({"EX0C": 12.0, "EB0A": -2.0}, seed=3, draw_setups=True).fit()
    numbers = fit.uncertainties()
    assert tuple(numbers) == fit.covariance.ids == tuple(parameter.id for parameter in fit.parameters)
    for parameter in fit.parameters:
        assert numbers[parameter.id].nominal_value == parameter.value
        assert numbers[parameter.id].std_dev == pytest.approx(parameter.u, rel=1e-9)
    expected = np.asarray(fit.covariance)
    scale = np.sqrt(np.outer(np.diag(expected), np.diag(expected)))
    assert np.asarray(covariance_matrix(list(numbers.values()))) / scale == pytest.approx(expected / scale, abs=1e-9)


def test_a_function_of_correlated_estimates_scatters_as_stated(chapter5):
    """The estimates of the most correlated pair of errors, over simulated sessions: their sum and their difference
    scatter by the uncertainties that the package computes, which differ from those of independent numbers."""
    pytest.importorskip("uncertainties")
    truth = {"EX0C": 12.0, "EB0A": -2.0}
    fits = [chapter5.simulate(truth, seed=seed, draw_setups=True).fit() for seed in range(60)]
    matrix = np.asarray(fits[0].covariance)
    correlation = matrix / np.sqrt(np.outer(np.diag(matrix), np.diag(matrix)))
    # Set-up parameters are drawn anew in each session: their estimates scatter about their own truth.
    units = [None if "[" in id else unit for id, unit in zip(fits[0].covariance.ids, fits[0].covariance.units)]
    same = np.array([[a == b is not None for b in units] for a in units])
    np.fill_diagonal(same, False)
    first, second = np.unravel_index(np.argmax(np.where(same, np.abs(correlation), 0.0)), matrix.shape)
    ids = [fits[0].covariance.ids[index] for index in (first, second)]
    assert abs(correlation[first, second]) > 0.3
    numbers = fits[0].uncertainties()
    a, b = (numbers[id] for id in ids)
    for combined, own in ((a + b, lambda x, y: x + y), (a - b, lambda x, y: x - y)):
        values = [own(*(fit[id].value for id in ids)) for fit in fits]
        spread = np.std(values, ddof=1)
        # The scatter of 60 values has a standard error of 9 %.
        assert spread == pytest.approx(combined.std_dev, rel=0.3)
    independent = math.hypot(a.std_dev, b.std_dev)
    assert abs((a + b).std_dev - independent) > 0.1 * independent


def test_without_the_package_the_message_names_it(chapter5, monkeypatch):
    fit = chapter5.simulate({"EX0C": 12.0}, seed=1).fit()
    monkeypatch.setitem(sys.modules, "uncertainties", None)
    with pytest.raises(abbe.Error, match="needs the package uncertainties") as found:
        fit.uncertainties()
    assert "abbe[uncertainties]" in found.value.help
