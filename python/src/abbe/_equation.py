"""Closed forms."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

from . import _abbe


class Equation:
    """The closed form of the readings of a test. :meth:`Session.equation` makes it.

    Examples
    --------
    >>> import abbe
    >>> session = abbe.Session(abbe.Machine.from_code("w C A b Y X Z t"), noise_um=0.3, constants={"R": 100})
    >>> session.add_test("C125", bar_mm=125, workpiece_ball_mm=(0, "R", 0), spindle_ball_mm=(0, 0, 0), z_mm=75,
    ...                  sweep={"axis": "C", "from_deg": 0, "to_deg": 360, "step_deg": 1})
    >>> equation = session.equation("C125", order="first", errors=["EX0C"])
    >>> "R" in equation.text()
    True
    """

    def __init__(
        self,
        session: _abbe.Session,
        test: str,
        order: str,
        rotation: str | None,
        errors: Sequence[str] | None,
        symbols: str,
    ) -> None:
        self._session = session
        self._form = (order, rotation, None if errors is None else list(errors), symbols)
        self.test = test
        self.text()

    def print(self, language: str, *, gradient: bool = False) -> str:
        """Return the equation in a language of ``abbe equation --as``.

        Parameters
        ----------
        language : str
            ``"text"``, ``"latex"``, ``"typst"``, ``"python"``, ``"rust"``, ``"c"``, ``"matlab"``, ``"julia"``.
        gradient : bool
            Add the derivatives.
        """
        return _abbe.equation(self._session, self.test, language, *self._form, gradient)

    def text(self) -> str:
        """Return the equation as text."""
        return self.print("text")

    def latex(self) -> str:
        """Return the equation as LaTeX."""
        return self.print("latex")

    def _repr_html_(self) -> str:
        return f"<pre>{self.text()}</pre>"

    def __str__(self) -> str:
        return self.text()

    def __repr__(self) -> str:
        return f"<abbe.Equation of {self.test!r}>"
