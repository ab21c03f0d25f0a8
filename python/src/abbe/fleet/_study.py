"""Studies: simulated sessions and their analysis on Dask."""

from __future__ import annotations

import json
import os
from collections.abc import Callable
from typing import Any

from .. import _abbe
from .._errors import Error
from ._run import Client, Run, through
from ._work import Path, run_draws


def study(
    file: Path,
    out: Path,
    *,
    client: str | Client | None = None,
    workers: int | None = None,
    batch: int | None = None,
    retries: int = 2,
    progress: bool | Callable[[int, int], object] = True,
) -> dict[str, Any]:
    """Simulate and analyse the sessions of a study file, as ``abbe fleet study``.

    Parameters
    ----------
    file : path-like
        The study file, which all workers reach by this name.
    out : path-like
        Folder of the draws. A second run makes only those that are missing.
    client, workers, batch, retries, progress
        As in :func:`run`.

    Returns
    -------
    dict
        The keys of ``abbe schema study``: power, false claims and coverage with their standard errors.
    """
    file, out = os.path.abspath(file), os.path.abspath(out)
    count = _abbe.study_draws(file)
    done = Run(out=out, sessions=count)
    through(client, workers, (run_draws, range(count), (out, file)), batch, retries, progress, done)
    text, missing = _abbe.study_summary(file, out)
    if missing:
        raise Error(f"{missing} of {count} draws are missing: their workers ended", help="run the study again")
    found: dict[str, Any] = json.loads(text)
    return found
