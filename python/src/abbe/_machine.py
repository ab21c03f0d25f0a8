"""Machines."""

from __future__ import annotations

import os
from collections.abc import Mapping
from typing import Any

from . import _abbe


def is_code(text: object) -> bool:
    """Whether a text is a structural code, such as ``"w C A b Y X Z t"``, and no path."""
    return isinstance(text, str) and len(text.split()) > 1 and not text.strip().endswith(".toml")


class Machine:
    """A serial kinematic chain: a machine tool or a robot.

    Parameters
    ----------
    source : str, path-like or mapping
        A structural code as for :meth:`from_code`, the path of a machine file as for :meth:`read`, or the tables of a
        machine file.

    Examples
    --------
    >>> import abbe
    >>> machine = abbe.Machine("w C A b Y X Z t")
    >>> machine.axes
    ('C', 'A', 'Y', 'X', 'Z')
    """

    _handle: _abbe.Machine

    def __init__(self, source: str | os.PathLike[str] | Mapping[str, Any] | Machine) -> None:
        if isinstance(source, Machine):
            self._handle = source._handle
        elif isinstance(source, Mapping):
            self._handle = _abbe.Machine.from_tables(dict(source))
        elif isinstance(source, str) and is_code(source):
            self._handle = _abbe.Machine.from_code(source)
        elif isinstance(source, (str, os.PathLike)):
            self._handle = _abbe.Machine.read(source)
        else:
            raise TypeError(
                f"a machine is a structural code (\"w C A b Y X Z t\"), the path of a machine file or its tables as a "
                f"dict; not {type(source).__name__}. The text of a machine file: Machine.from_toml(text)"
            )

    @classmethod
    def _of(cls, handle: _abbe.Machine) -> Machine:
        machine = cls.__new__(cls)
        machine._handle = handle
        return machine

    @classmethod
    def from_code(cls, code: str) -> Machine:
        """Return the machine of a structural code, with axes by ISO 841 through one point.

        Parameters
        ----------
        code : str
            The axes from workpiece over bed to tool, such as ``"w C A b Y X Z t"``.
        """
        return cls._of(_abbe.Machine.from_code(code))

    @classmethod
    def read(cls, path: str | os.PathLike[str]) -> Machine:
        """Read a machine file.

        Parameters
        ----------
        path : path-like
            The file, ``machine.toml``.
        """
        return cls._of(_abbe.Machine.read(path))

    @classmethod
    def from_toml(cls, text: str) -> Machine:
        """Return the machine of the text of a machine file.

        Parameters
        ----------
        text : str
            The text.
        """
        return cls._of(_abbe.Machine.from_toml(text))

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
