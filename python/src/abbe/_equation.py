"""Closed forms."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from types import FunctionType, SimpleNamespace
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
        notation: str,
        symbols: Sequence[str] | None,
    ) -> None:
        self._session = session
        names = [None if group is None else list(group) for group in (errors, symbols)]
        self._form = (order, rotation, names[0], notation, names[1])
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

    def numpy(self, *, gradient: bool = False) -> Callable[..., Any]:
        """Return the equation as a function of NumPy arrays: the program of ``print("python")``.

        Parameters
        ----------
        gradient : bool
            Return value and derivatives.

        Returns
        -------
        callable
            The function. ``help`` on its module lists the arguments with their units: ``print("python")``.
        """
        return self._functions(gradient)["gradient" if gradient else "value"]

    def sympy(self) -> Any:
        """Return the equation as a SymPy expression. Needs SymPy.

        Its symbols are lengths in mm, positions of axes (angles in rad) and errors in mm and rad, with the names of
        ``print("python")``.
        """
        import sympy

        value = self._functions(False)["value"]
        arguments: dict[str, list[Any]] = {}
        listed = re.findall(r"^ +(\w+)\[\d+\] +(\w+)", self.print("python"), re.MULTILINE)
        for group, name in listed:
            turn = re.fullmatch(r"(sin|cos)_(\w+)", name)
            symbol = sympy.Symbol(turn[2] if turn else name, real=True)
            arguments.setdefault(group, []).append(getattr(sympy, turn[1])(symbol) if turn else symbol)
        # The program with the functions of SymPy in place of those of NumPy.
        value.__globals__["np"] = SimpleNamespace(
            **{name: getattr(sympy, name) for name in ("sqrt", "sin", "cos", "exp", "sign", "pi")},
            abs=sympy.Abs,
            shape=lambda argument: (),
            broadcast_shapes=lambda *shapes: (),
            broadcast_to=lambda value, shape: value,
        )
        names = value.__code__.co_varnames[: value.__code__.co_argcount]
        return sympy.nsimplify(value(*(arguments.get(name, []) for name in names)), rational=True)

    def _functions(self, gradient: bool) -> dict[str, FunctionType]:
        namespace: dict[str, Any] = {}
        exec(compile(self.print("python", gradient=gradient), f"<equation of {self.test}>", "exec"), namespace)
        functions = [item for item in namespace.values() if isinstance(item, FunctionType)]
        return {"gradient" if item.__name__.endswith("_gradient") else "value": item for item in functions}

    def _repr_html_(self) -> str:
        return f"<pre>{self.text()}</pre>"

    def __str__(self) -> str:
        return self.text()

    def __repr__(self) -> str:
        return f"<abbe.Equation of {self.test!r}>"
