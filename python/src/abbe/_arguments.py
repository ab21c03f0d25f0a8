"""Arguments of sessions as the native part takes them."""

from __future__ import annotations

import os
import re
from collections.abc import Mapping, Sequence
from typing import Any

from . import _abbe
from ._errors import SessionError
from ._machine import Machine, is_code


def whole_session(
    source: Machine | str | os.PathLike[str] | Mapping[str, Any], stated: tuple[object, ...]
) -> _abbe.Session | None:
    """The session of a file, or of its tables, which states all that is ``stated`` elsewhere; ``None`` of a machine."""
    if not isinstance(source, (Machine, str, os.PathLike, Mapping)):
        raise TypeError(
            f"a session begins with a Machine, a structural code or the path of a session file, not with "
            f"{type(source).__name__}: Session(Machine(...), \"ballbar\") or Session(\"session.toml\")"
        )
    if isinstance(source, Machine) or is_code(source) or isinstance(source, Mapping) and "machine" not in source:
        return None
    if any(argument is not None for argument in stated):
        raise TypeError(
            "a session file states instrument, noise, errors, constants and notes itself: "
            "Session(path) without them, or Session(Machine(path), ...) for the path of a machine file"
        )
    if not isinstance(source, Mapping):
        return _abbe.Session.read(source)
    head = {key: value for key, value in source.items() if key not in ("machine", "test", "effect", "socket_distance")}
    machine = source["machine"]
    if isinstance(machine, Mapping) and set(machine) == {"file"}:
        machine = machine["file"]
    session = _abbe.Session.new(Machine(machine)._handle, head)
    for test in source.get("test", ()):
        keys = dict(test)
        session.add_test(keys.pop("name", ""), keys)
    for table in ("effect", "socket_distance"):
        for entry in source.get(table, ()):
            session.add(table, dict(entry))
    return session


def quantity(name: str, value: float | str) -> tuple[float, str | None]:
    """A number with its unit, if it is written with one."""
    if not isinstance(value, str):
        return float(value), None
    found = re.fullmatch(r"\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)\s*(\D\S*)\s*", value)
    if found is None:
        raise SessionError(f"`{name}` = {value!r} is no number with a unit", help='write it as in "35.3um"')
    return float(found[1]), found[2]


def texts(name: str, texts: Sequence[str]) -> list[str]:
    """A list of texts, and not one text, which is a sequence too."""
    if isinstance(texts, str):
        raise TypeError(f"{name}: a list of texts is expected, such as [{texts!r}]")
    return list(texts)
