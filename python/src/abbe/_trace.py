"""Traces."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ._fit import ByTest, by_test, parameter
from ._model import Model
from ._shown import Shown, Table
from .results import Estimate, TraceResult

if TYPE_CHECKING:
    from ._session import Session


class Trace(Shown, TraceResult):
    """A traced session: the result of ``abbe trace``, with its arrays. :meth:`Session.trace` makes it.

    ``trace["EX0C"]`` is the estimate of a parameter after the trace, or of a coefficient of a found effect.
    """

    _analysis = "trace"
    _called = "abbe.Session.trace"
    _inputs: tuple[Session]

    def __getitem__(self, id: str) -> Estimate:
        of_effects = (estimate for effect in self.effects for estimate in effect.parameters)
        return parameter((*self.after.parameters, *of_effects), id)

    @property
    def residuals(self) -> ByTest:
        """Residuals of the model with the found effects in µm by test: one row for each reading."""
        return by_test(self._inputs[0], self._handle.residuals_um)

    @property
    def residuals_before(self) -> ByTest:
        """Residuals of the declared model in µm by test: one row for each reading."""
        return by_test(self._inputs[0], lambda test: self._handle.residuals_um(test, True))

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
        return type(self._inputs[0])._of(self._handle.session())

    def __repr__(self) -> str:
        return f"<abbe.Trace: {self.verdict}, {len(self.effects)} effects>"
