"""Foreign files of readings as a session."""

from __future__ import annotations

import json
import os
import warnings
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from . import _abbe
from ._session import Session
from ._shown import write_whole


class Imported(NamedTuple):
    """A session of foreign files."""

    session: Session
    """The session with its readings."""
    path: Path
    """The session file."""
    result: dict[str, Any]
    """How the files were understood: the JSON of ``abbe import``."""


def import_readings(
    files: str | os.PathLike[str] | Sequence[str | os.PathLike[str]],
    *,
    machine: str | os.PathLike[str] | None = None,
    out: str | os.PathLike[str] | None = None,
    session: str | os.PathLike[str] | None = None,
    kind: str | None = None,
    set: Mapping[str, Any] | None = None,
    columns: Mapping[str, str | int] | None = None,
    like: str | None = None,
    allow_outside: bool = False,
    allow_implausible: bool = False,
) -> Imported:
    """Import foreign files of readings: each becomes the test of its name, as ``abbe import``.

    Separator, decimal sign, encoding, lines above, columns and units are guessed. Readings that contradict the machine
    are refused; the message names the mistake that explains them.

    Parameters
    ----------
    files : path-like or sequence of path-like
        The files.
    machine : path-like, optional
        The machine file of a new session, which is written into `out`.
    out : path-like, optional
        The folder of the new session. It is made; files in it with the same names are replaced.
    session : path-like, optional
        The session file to which the tests are added. A file with the name of a planned test gives it its readings.
        No other file beside it is replaced.
    kind : str, optional
        The instrument of a new session, such as ``"tracker"``, if the columns do not tell.
    set : mapping, optional
        Keys of the new tests: ``{"bar_mm": 150, "workpiece_ball_mm": [0, 100, 0]}``.
    columns : mapping of str to str or int, optional
        What columns hold: our name with its unit to the name or the number in the file.
    like : str, optional
        The test of the session whose set-up new tests have.
    allow_outside : bool
        Accept a session that reads files outside its folder.
    allow_implausible : bool
        Accept readings that contradict the machine.

    Returns
    -------
    Imported
        The session, its file, and how the files were understood.

    Raises
    ------
    SessionError
        If a file cannot be understood.
    FileExistsError
        If another file beside `session` has the name of one that would be written. Nothing is written then.
    IdentificationError
        If the readings contradict the machine.

    Warns
    -----
    UserWarning
        Of units that were guessed, and of rows and columns that are not read.
    """
    if isinstance(files, (str, os.PathLike)):
        files = [files]
    if (machine is None) == (session is None) or (machine is None) != (out is None):
        raise TypeError("state `machine` with `out`, or `session`")
    hints = [f"{own}={theirs}" for own, theirs in (columns or {}).items()]
    written, result = _abbe.import_readings(
        [Path(file) for file in files],
        machine,
        session,
        kind,
        dict(set or {}),
        hints,
        like,
        allow_outside,
        allow_implausible,
    )
    # What was guessed and what is not read.
    for warning in json.loads(result)["warnings"]:
        warnings.warn(warning, stacklevel=2)
    folder = Path(session).parent if session is not None else Path(out or ".")
    folder.mkdir(parents=True, exist_ok=True)
    present = [Path(file).resolve() for file in files]
    if session is not None:
        for name, contents in written[:-1]:
            path = folder / name
            if path.resolve() not in present and path.exists() and path.read_bytes() != contents:
                raise FileExistsError(f"{path}: a file with this name and other contents exists; rename one of the two")
    for name, contents in written:
        path = folder / name
        # A file that lies beside the session already is read where it is.
        if path.resolve() not in present:
            path.parent.mkdir(parents=True, exist_ok=True)
            write_whole(path, contents)
    path = folder / written[-1][0]
    return Imported(Session.read(path, allow_outside=allow_outside), path, json.loads(result))
