"""Plans."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from . import _abbe
from ._shown import Shown
from .results import PlanAnalysis

if TYPE_CHECKING:
    from ._session import Session


class Plan(Shown, PlanAnalysis):
    """An analysed plan: the result of ``abbe plan``, with its arrays. :meth:`Session.plan` makes it."""

    def __init__(
        self,
        session: Session,
        noise_um: float | None,
        planned: bool,
        effects: bool,
        source: dict[str, Any] | None = None,
    ) -> None:
        self._session = session
        self._options = (noise_um, planned, effects)
        self._known: _abbe.Plan | None = None
        PlanAnalysis.__init__(self, json.loads(self._handle.json(1)) if source is None else source)

    @property
    def _handle(self) -> _abbe.Plan:
        # A plan from another process is analysed again when a matrix or a figure is needed.
        if self._known is None:
            self._known = _abbe.Plan.of(self._session._handle, *self._options)
        return self._known

    def __reduce__(self) -> tuple[Any, ...]:
        return (Plan, (self._session, *self._options, dict(self._source)))

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

    def _tables(self) -> list[_abbe.Table]:
        return self._handle.tables()

    def _figures(self) -> list[_abbe.Figure]:
        return self._handle.figures()

    def _shown(self) -> tuple[str, str]:
        return self._handle.shown()

    def _page(self) -> str:
        return self._handle.page(1)

    def __repr__(self) -> str:
        return f"<abbe.Plan: {int(self.identifiable.sum())} of {len(self.errors)} errors identifiable>"
