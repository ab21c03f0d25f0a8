"""The best weights of candidate rows, by sequential quadratic programming: JSON on standard input, optima on standard output."""

import json
import sys

import numpy as np
from scipy.optimize import minimize


def optimum(problem):
    size = np.array(problem["size"])
    base = np.array(problem["base"]) * size
    rows = [np.array(block) * size for block in problem["rows"]]
    each = np.array([block.T @ block for block in rows])
    base = base.T @ base
    targets = np.arange(len(size) - problem["targets"], len(size))
    display = (size * np.array(problem["display"]))[targets]
    count = problem["count"]

    def covariance(weights):
        return np.linalg.inv(base + np.tensordot(weights, each, 1))

    def variances(c):
        return np.diag(c)[targets] * display**2

    def slope(c, left):
        """The derivative of tr(left C) by the weights."""
        product = c @ left @ c
        return -np.einsum("nij,ji->n", each, product)

    def selected(weights_of_targets):
        left = np.zeros_like(base)
        left[targets, targets] = weights_of_targets * display**2
        return left

    start = np.full(len(rows), count / len(rows))
    bounds = [(0, None)] * len(rows)
    options = {"maxiter": 2000, "ftol": 1e-10}
    if problem["goal"] == "a":
        of = lambda w: np.log(variances(covariance(w)).mean())

        def gradient(w):
            c = covariance(w)
            return slope(c, selected(np.full(len(targets), 1 / len(targets)))) / variances(c).mean()

        found = minimize(of, start, jac=gradient, bounds=bounds, constraints=[{"type": "eq", "fun": lambda w: w.sum() - count, "jac": lambda w: np.ones_like(w)}], method="SLSQP", options=options)
        return float(np.exp(0.5 * found.fun))
    if problem["goal"] == "d":
        def of(w):
            c = covariance(w)[np.ix_(targets, targets)] * np.outer(display, display)
            return np.linalg.slogdet(c)[1] / len(targets)

        def gradient(w):
            c = covariance(w)
            own = np.linalg.inv(c[np.ix_(targets, targets)])
            left = np.zeros_like(base)
            left[np.ix_(targets, targets)] = own
            return slope(c, left) / len(targets)

        found = minimize(of, start, jac=gradient, bounds=bounds, constraints=[{"type": "eq", "fun": lambda w: w.sum() - count, "jac": lambda w: np.ones_like(w)}], method="SLSQP", options=options)
        return float(np.exp(0.5 * found.fun))
    # The smallest t with log C_jj ≤ t.
    def excess(x):
        return x[-1] - np.log(variances(covariance(x[:-1])))

    def excess_slope(x):
        c = covariance(x[:-1])
        v = variances(c)
        full = [slope(c, selected(np.eye(len(targets))[j])) / v[j] for j in range(len(targets))]
        return np.hstack([-np.array(full), np.ones((len(targets), 1))])

    first = np.append(start, np.log(variances(covariance(start)).max()))
    last = np.append(np.zeros(len(rows)), 1.0)
    ones = np.append(np.ones(len(rows)), 0.0)
    found = minimize(lambda x: x[-1], first, jac=lambda x: last, bounds=bounds + [(None, None)], constraints=[{"type": "eq", "fun": lambda x: x[:-1].sum() - count, "jac": lambda x: ones}, {"type": "ineq", "fun": excess, "jac": excess_slope}], method="SLSQP", options=options)
    return float(np.exp(0.5 * found.x[-1]))


json.dump([optimum(problem) for problem in json.load(sys.stdin)], sys.stdout)
