"""Traces."""

from __future__ import annotations

import json
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from . import _abbe
from ._fit import ByTest, by_test, parameter
from ._model import Model
from ._shown import Shown, Table
from .results import ParameterResult, TraceResult

if TYPE_CHECKING:
    from ._session import Session


class Trace(Shown, TraceResult):
    """A traced session: the result of ``abbe trace``, with its arrays. :meth:`Session.trace` makes it.

    ``trace["EX0C"]`` is the estimate of a parameter after the trace, or of a coefficient of a found effect.
    """

    def __init__(
        self,
        session: Session,
        progress: Callable[[str], object] | None,
        max_effects: int | None,
        only: list[str],
        exclude: list[str],
        time_limit: float | None,
        seed: int,
        allow_implausible: bool,
        source: dict[str, Any] | None = None,
    ) -> None:
        self._session = session
        self._options = (max_effects, only, exclude, time_limit, seed, allow_implausible)
        self._known = None if source is not None else _abbe.Trace.of(session._handle, progress, *self._options)
        TraceResult.__init__(self, json.loads(self._handle.json()) if source is None else source)

    @property
    def _handle(self) -> _abbe.Trace:
        # A trace from another process is repeated when an array or a figure is needed: it is deterministic.
        if self._known is None:
            self._known = _abbe.Trace.of(self._session._handle, None, *self._options)
        return self._known

    def __reduce__(self) -> tuple[Any, ...]:
        return (Trace, (self._session, None, *self._options, dict(self._source)))

    def __getitem__(self, id: str) -> ParameterResult:
        of_effects = (estimate for effect in self.effects for estimate in effect.parameters)
        return parameter((*self.after.parameters, *of_effects), id)

    @property
    def residuals(self) -> ByTest:
        """Residuals of the model with the found effects in µm by test: one row for each reading."""
        return by_test(self._session, lambda test: self._handle.residuals_um(test, False))

    @property
    def residuals_before(self) -> ByTest:
        """Residuals of the declared model in µm by test: one row for each reading."""
        return by_test(self._session, lambda test: self._handle.residuals_um(test, True))

    @property
    def is_outlier(self) -> ByTest:
        """Whether each reading is excluded as an outlier, by test."""
        return ByTest(self.residuals._tests, self._handle.is_outlier)

    def residual_table(self) -> Table:
        """Return the table of ``--residuals``: one row for each reading."""
        return Table(self._handle.residual_table())

    def model(self) -> Model:
        """Return the identified model with the found effects, which other sessions can validate."""
        return Model._of(self._handle.model())

    def session(self) -> Session:
        """Return the session with the found effects declared, as ``--write`` does."""
        return type(self._session)._of(self._handle.session())

    def _tables(self) -> list[_abbe.Table]:
        return self._handle.tables()

    def _figures(self) -> list[_abbe.Figure]:
        return self._handle.figures()

    def _shown(self) -> tuple[str, str]:
        return self._handle.shown()

    def _page(self) -> str:
        return self._handle.page()

    def __repr__(self) -> str:
        return f"<abbe.Trace: {self.verdict}, {len(self.effects)} effects>"
