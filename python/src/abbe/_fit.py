"""Fits."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from importlib import import_module
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ._errors import Error
from ._model import Model
from ._shown import Shown, Table, rows_of
from .results import Estimate, FitResult

if TYPE_CHECKING:
    from ._session import Session


class ByTest(Mapping[str, NDArray[Any]]):
    """An array for each test, made when it is asked for."""

    def __init__(self, tests: tuple[str, ...], of: Callable[[str], NDArray[Any]]) -> None:
        self._tests = tests
        self._of = of

    def __getitem__(self, test: str) -> NDArray[Any]:
        if test not in self._tests:
            raise KeyError(f"no test {test!r}; the tests are {', '.join(self._tests)}")
        return self._of(test)

    def __iter__(self) -> Iterator[str]:
        return iter(self._tests)

    def __len__(self) -> int:
        return len(self._tests)


def by_test(session: Session, of: Callable[[str], NDArray[Any]]) -> ByTest:
    """An array for each test with readings, with one row for each reading."""
    measured = {name: coordinates for name, rows, coordinates in session._handle.tests() if rows}
    return ByTest(tuple(measured), lambda test: rows_of(of(test), measured[test]))


def parameter(parameters: tuple[Estimate, ...], id: str) -> Estimate:
    """The parameter of this identifier."""
    for found in parameters:
        if found.id == id:
            return found
    known = ", ".join(found.id for found in parameters)
    raise KeyError(f"no estimate of {id!r}; there are estimates of {known}")


class Fit(Shown, FitResult):
    """A fitted session: the result of ``abbe fit``, with its arrays. :meth:`Session.fit` makes it.

    ``fit["EX0C"]`` is the estimate of a parameter.
    """

    _analysis = "fit"
    _called = "abbe.Session.fit"
    _inputs: tuple[Session]

    def __getitem__(self, id: str) -> Estimate:
        return parameter(self.parameters, id)

    @property
    def estimates(self) -> NDArray[np.float64]:
        """Estimates of all parameters of the session in the order of ``Session.parameters``, each in its unit.

        NaN where a parameter is not identifiable: it has no estimate of its own, and ``fit["EY0C"]`` refuses it.
        """
        known = set(self.identifiable)
        own = np.array([parameter.id in known for parameter in self._inputs[0].parameters])
        return np.where(own, self.solution, np.nan)

    @property
    def solution(self) -> NDArray[np.float64]:
        """The parameters with which the model predicts the readings, in the order of ``Session.parameters``.

        The part of a parameter in a null-space direction is its nominal value: predictions do not depend on it.
        """
        return self._handle.estimates()

    def uncertainties(self) -> dict[str, Any]:
        """Return the estimates as correlated numbers of the package ``uncertainties``, which it needs.

        Functions of them have the uncertainty that follows from the covariance of the fit, to first order.

        Returns
        -------
        dict of str to uncertainties.UFloat
            The estimates of `parameters` by identifier, each in its unit.
        """
        try:
            package = import_module("uncertainties")
        except ImportError as cause:
            raise Error("this needs the package uncertainties", help="pip install abbe[uncertainties]") from cause
        ids, matrix = self.covariance.ids, np.asarray(self.covariance)
        values = package.correlated_values([self[id].value for id in ids], matrix, tags=ids)
        return dict(zip(ids, values))

    @property
    def residuals(self) -> ByTest:
        """Residuals observed less model in µm by test: one row for each reading, outliers included."""
        return by_test(self._inputs[0], self._handle.residuals_um)

    @property
    def is_outlier(self) -> ByTest:
        """Whether each reading is excluded as an outlier, by test."""
        return ByTest(self.residuals._tests, self._handle.is_outlier)

    def residual_table(self) -> Table:
        """Return the table of ``--residuals``: one row for each reading."""
        return Table(self._handle.residual_table())

    def model(self) -> Model:
        """Return the identified model, which other sessions can validate."""
        return Model._of(self._handle.model())

    def __repr__(self) -> str:
        # A session of angles states its figures in arcsec.
        angles = self._source.get("rms_arcsec")
        rms = f"{self.rms_um:.3g} µm" if angles is None else f"{angles:.3g} arcsec"
        return f"<abbe.Fit: {len(self.parameters)} estimates, residual {rms} rms>"
