"""The unit of work, in this process."""

from __future__ import annotations

import json
import os
import time
from collections.abc import Iterable, Iterator, Sequence
from typing import TYPE_CHECKING, Any, TypeAlias

from .. import _abbe

if TYPE_CHECKING:
    import pandas

Path: TypeAlias = "str | os.PathLike[str]"

Outcome: TypeAlias = "tuple[str, bool, str, float]"
"""A session file, whether it was computed, its note as JSON, and the seconds that it took."""


def options_json(
    trace: bool = True,
    max_effects: int | None = None,
    only: Sequence[str] = (),
    exclude: Sequence[str] = (),
) -> str:
    """The options of the analysis as JSON. They are part of the key of each result."""
    if isinstance(only, str) or isinstance(exclude, str):
        raise TypeError("only and exclude are sequences of texts")
    return json.dumps(
        {"no_trace": not trace, "max_effects": max_effects, "only": list(only), "exclude": list(exclude)}
    )


def analyse(
    session: Path,
    *,
    trace: bool = True,
    max_effects: int | None = None,
    only: Sequence[str] = (),
    exclude: Sequence[str] = (),
    models: Path | None = None,
    allow_outside: bool = False,
) -> dict[str, Any]:
    """Analyse a session: a pure function of its files and the options.

    Parameters
    ----------
    session : path-like
        The session file.
    trace : bool
        Search for effects; a fit alone otherwise.
    max_effects : int, optional
        Maximum number of effects.
    only, exclude : sequence of str
        Search only, or not, effects whose identifier contains one of these texts.
    models : path-like, optional
        Folder of saved models to validate: ``MACHINE.json`` is the model of the machine with this identifier.
    allow_outside : bool
        Allow the session to read files outside its own folder.

    Returns
    -------
    dict
        The record of ``abbe schema record``. A session that cannot be analysed has ``error``.
    """
    options = options_json(trace, max_effects, only, exclude)
    record: dict[str, Any] = json.loads(_abbe.analyse_session(session, options, models, allow_outside))
    return record


def map_in_pandas(batches: Iterable[pandas.DataFrame]) -> Iterator[pandas.DataFrame]:
    """Analyse the sessions of data frames: the function of ``DataFrame.mapInPandas`` of Spark.

    It depends on nothing but its argument, and keeps nothing.

    Parameters
    ----------
    batches : iterable of pandas.DataFrame
        Frames with a column ``file``: session files. A column ``options`` may hold options as JSON.

    Yields
    ------
    pandas.DataFrame
        Columns ``file``, ``key`` and ``record``, the record as JSON: ``file string, key string, record string``.
    """
    import pandas

    _abbe.set_threads(1)
    for batch in batches:
        options = batch["options"] if "options" in batch else [options_json()] * len(batch)
        texts = [_abbe.analyse_session(file, own, None, False) for file, own in zip(batch["file"], options)]
        keys = [json.loads(text)["key"] for text in texts]
        yield pandas.DataFrame({"file": list(batch["file"]), "key": keys, "record": texts}, dtype="object")


def run_sessions(
    files: Sequence[str], out: str, options: str, models: str | None, allow_outside: bool, threads: int
) -> list[Outcome]:
    """Analyse the sessions of a batch into the folder of results. What a worker of Dask does."""
    _abbe.set_threads(threads)
    outcomes: list[Outcome] = []
    for file in files:
        start = time.perf_counter()
        computed, note = _abbe.run_session(file, out, options, models, allow_outside)
        outcomes.append((file, computed, note, time.perf_counter() - start))
    return outcomes
