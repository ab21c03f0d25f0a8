"""Plans."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ._shown import Shown
from .results import PlanAnalysis


class Plan(Shown, PlanAnalysis):
    """An analysed plan: the result of ``abbe plan``, with its arrays. :meth:`Session.plan` makes it."""

    _analysis = "plan"
    _called = "abbe.Session.plan"

    @property
    def ids(self) -> tuple[str, ...]:
        """The errors, in the order of the arrays."""
        return tuple(error.id for error in self.errors)

    @property
    def units(self) -> tuple[str, ...]:
        """The unit of each error: ``um``, ``arcsec``, ..."""
        return tuple(error.unit for error in self.errors)

    @property
    def uncertainty(self) -> NDArray[np.float64]:
        """Predicted standard uncertainty of each error in its unit; NaN where it is not identifiable."""
        return np.array([np.nan if error.u is None else error.u for error in self.errors])

    @property
    def identifiable(self) -> NDArray[np.bool_]:
        """Whether each error is identifiable."""
        return np.array([error.u is not None for error in self.errors])

    def sensitivity(self, test: str) -> NDArray[np.float64]:
        """Return the change of each reading of a test by each error.

        Parameters
        ----------
        test : str
            The test.

        Returns
        -------
        ndarray
            One row for each scalar reading, one column for each of ``ids``: µm per unit of the error.
        """
        return self._handle.sensitivity(test)

    def __repr__(self) -> str:
        return f"<abbe.Plan: {int(self.identifiable.sum())} of {len(self.errors)} errors identifiable>"
