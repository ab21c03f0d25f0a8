"""Machines."""

from __future__ import annotations

import os
from typing import Any

from . import _abbe


class Machine:
    """A serial kinematic chain: a machine tool or a robot.

    Make one with :meth:`from_code`, :meth:`read` or :meth:`from_toml`.

    Examples
    --------
    >>> import abbe
    >>> machine = abbe.Machine.from_code("w C A b Y X Z t")
    >>> machine.axes
    ('C', 'A', 'Y', 'X', 'Z')
    """

    def __init__(self, handle: _abbe.Machine) -> None:
        self._handle = handle

    @classmethod
    def from_code(cls, code: str) -> Machine:
        """Return the machine of a structural code, with axes by ISO 841 through one point.

        Parameters
        ----------
        code : str
            The axes from workpiece over bed to tool, such as ``"w C A b Y X Z t"``.
        """
        return cls(_abbe.Machine.from_code(code))

    @classmethod
    def read(cls, path: str | os.PathLike[str]) -> Machine:
        """Read a machine file.

        Parameters
        ----------
        path : path-like
            The file, ``machine.toml``.
        """
        return cls(_abbe.Machine.read(path))

    @classmethod
    def from_toml(cls, text: str) -> Machine:
        """Return the machine of the text of a machine file.

        Parameters
        ----------
        text : str
            The text.
        """
        return cls(_abbe.Machine.from_toml(text))

    def to_toml(self) -> str:
        """Return the text of a machine file."""
        return self._handle.to_toml()

    @property
    def name(self) -> str:
        """The name of the machine."""
        return self._handle.name

    @property
    def code(self) -> str:
        """The structural code."""
        return self._handle.code

    @property
    def axes(self) -> tuple[str, ...]:
        """The names of the axes from workpiece to tool."""
        return tuple(self._handle.axes)

    @property
    def errors(self) -> tuple[str, ...]:
        """The names of all location errors and error motions of the axes (ISO 230-1)."""
        return tuple(self._handle.errors())

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Machine) and self._handle == other._handle

    def __hash__(self) -> int:
        return hash(self.to_toml())

    def __reduce__(self) -> tuple[Any, ...]:
        return (Machine.from_toml, (self.to_toml(),))

    def __repr__(self) -> str:
        return f"<abbe.Machine {self.name!r}: {self.code}>"
