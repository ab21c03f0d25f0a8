"""A run: the sessions of a fleet on Dask."""

from __future__ import annotations

import asyncio
import json
import logging
import os
import sys
import threading
import uuid
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass, field
from importlib import import_module
from itertools import islice
from typing import Any, TypeAlias

from .. import _abbe
from .._errors import Error
from ._work import Outcome, Path, options_json, run_sessions

Client: TypeAlias = Any
"""``distributed.Client``. Dask has types in part only."""

Future: TypeAlias = Any
"""``distributed.Future``."""

_MOST_IN_BATCH = 32
"""Most sessions of a batch: some seconds of work, of which a killed worker loses at most one batch."""

_BATCHES_AHEAD = 4
"""Batches that each worker has waiting. The scheduler never holds more, however many sessions there are."""

_CONNECT_S = 15.0
"""Time in which a scheduler has to answer."""

_ALONE_S = 30.0
"""Time without a worker after which a run says so."""

_MOST_ALONE_S = 3600.0
"""Longest time to the next such message. It grows from message to message."""

_LOG = logging.getLogger("abbe.fleet")


@dataclass(frozen=True)
class Failure:
    """A session without a result."""

    file: str
    """The session file."""
    message: str
    """What was found and what was expected."""


@dataclass
class Run:
    """What a run did."""

    out: str
    """The folder of the results."""
    sessions: int = 0
    """Number of sessions."""
    computed: int = 0
    """Sessions that were analysed."""
    kept: int = 0
    """Sessions whose result was there."""
    failed: list[Failure] = field(default_factory=list)
    """Sessions that cannot be analysed. Their errors are results."""
    lost: list[Failure] = field(default_factory=list)
    """Sessions during which workers ended again and again. They have no result; the next run tries them again."""
    shared_ids: dict[str, list[str]] = field(default_factory=dict)
    """Identifiers that several sessions of different content have, with their files."""
    forgotten: list[str] = field(default_factory=list)
    """Session files of earlier runs that are no longer there: they have left history and data set."""
    seconds: float = 0.0
    """Time that the workers spent in the analysis, all together."""

    def __repr__(self) -> str:
        return (
            f"<abbe.fleet.Run: {self.sessions} sessions, {self.computed} computed, {self.kept} kept, "
            f"{len(self.failed)} failed, {len(self.lost)} lost>"
        )


def run(
    sessions: Path | Iterable[Path],
    out: Path,
    *,
    client: str | Client | None = None,
    workers: int | None = None,
    batch: int | None = None,
    retries: int = 2,
    threads: int = 1,
    progress: bool | Callable[[int, int], object] = True,
    trace: bool = True,
    max_effects: int | None = None,
    only: Sequence[str] = (),
    exclude: Sequence[str] = (),
    models: Path | None = None,
    allow_outside: bool = False,
) -> Run:
    """Analyse sessions, and keep what is done.

    A result is a file of `out` whose name is the SHA-256 of all inputs and options. A second run computes only what is
    missing or changed. Ctrl-C ends the run; finished results stay. A run whose scheduler has no worker waits for one; a
    warning of the logger ``abbe.fleet`` says so after 30 s, and again.

    Parameters
    ----------
    sessions : path-like or iterable of path-like
        Session files, or folders in which every ``session.toml`` is found. All workers reach them by these names.
    out : path-like
        Folder of the results, which all workers reach by this name.
    client : str or distributed.Client, optional
        A scheduler (``"tcp://host:8786"``) or a client; a local cluster with one process for each core by default.
    workers : int, optional
        Processes of the local cluster.
    batch : int, optional
        Sessions of a task; by default an eighth of the share of a worker, 32 at most.
    retries : int
        Times that a session is tried again, alone, at the end of the run, after Dask has given up its batch: after four
        workers ended during it (``distributed.scheduler.allowed-failures``).
    threads : int
        Threads of the analysis of one session.
    progress : bool or callable
        A bar on standard error, or a function of the numbers of done and of all sessions.
    trace, max_effects, only, exclude, models, allow_outside
        As in :func:`analyse`.

    Returns
    -------
    Run
        Counts, and the sessions without a result.

    Raises
    ------
    abbe.Error
        If the scheduler cannot be reached or is lost, or a result cannot be written.
    """
    named: Iterable[Path] = [sessions] if isinstance(sessions, (str, os.PathLike)) else sessions
    paths = [os.path.abspath(path) for path in named]
    files = [str(file) for file in _abbe.session_files(paths)]
    options = options_json(trace, max_effects, only, exclude)
    if retries < 0 or threads < 1 or (batch is not None and batch < 1) or (workers is not None and workers < 1):
        raise ValueError("workers, batch and threads are at least 1, retries at least 0")
    out = os.path.abspath(out)
    forgotten = _abbe.forget_missing_sessions(out, paths)
    common = (out, options, None if models is None else os.path.abspath(models), allow_outside, threads)
    result = Run(out=out, sessions=len(files), forgotten=forgotten)
    if files:
        show = _bar if progress is True else (progress or (lambda done, all: None))
        with _connected(client, workers, len(files)) as connected:
            _Work(connected, common, retries, result, show).through(files, batch)
    return result


def _present_workers(client: Client) -> int:
    """The workers of the scheduler. They may join and leave during a run."""
    return len(client.scheduler_info(n_workers=-1)["workers"])


def _dask() -> Any:
    try:
        return import_module("distributed")
    except ImportError as cause:
        raise Error("this needs Dask", help="pip install abbe[fleet]") from cause


@contextmanager
def _connected(client: str | Client | None, workers: int | None, sessions: int) -> Iterator[Client]:
    """The client of the caller, or one that ends with the run."""
    dask = _dask()
    if isinstance(client, dask.Client):
        yield client
        return
    if client is None:
        count = min(workers or os.cpu_count() or 1, sessions)
        with (
            dask.LocalCluster(
                n_workers=count, threads_per_worker=1, processes=True, dashboard_address=None, silence_logs="ERROR"
            ) as cluster,
            dask.Client(cluster) as own,
        ):
            yield own
        return
    try:
        # Dask waits without a limit for the first words of what listens at the address.
        with ThreadPoolExecutor(1) as thread:
            thread.submit(asyncio.run, _answers(client)).result()
        own = dask.Client(client, timeout=_CONNECT_S)
    except Exception as cause:
        why = str(cause) or f"no answer in {_CONNECT_S:.0f} s"
        raise Error(
            f"the scheduler {client} cannot be reached: {why}",
            help="start it with `dask scheduler`, and workers with `dask worker ADDRESS --nthreads 1`",
        ) from cause
    with own:
        yield own


async def _answers(address: str) -> None:
    """Return if what listens at the address speaks as Dask does."""
    dask = _dask()
    arguments = dask.Security().get_connection_args("client")
    connected = dask.comm.connect(address, timeout=_CONNECT_S, **arguments)
    (await asyncio.wait_for(connected, _CONNECT_S)).abort()


class _Work:
    """The batches of a run that are under way."""

    def __init__(
        self,
        client: Client,
        common: tuple[Any, ...],
        retries: int,
        result: Run,
        show: Callable[[int, int], object],
    ) -> None:
        self._client = client
        self._common = common
        self._retries = retries
        self._result = result
        self._show = show
        self._tried: dict[Any, int] = {}
        self._suspects: deque[Any] = deque()
        self._items: dict[str, list[Any]] = {}
        self._keys: dict[str, dict[str, list[str]]] = {}
        self._done = 0

    def _submit(self, items: list[Any]) -> Future:
        # Dask itself repeats a batch whose worker ended, up to its own limit; then the batch comes back.
        future = self._client.submit(run_sessions, items, *self._common, key=f"abbe-{uuid.uuid4()}", pure=False)
        self._items[future.key] = items
        return future

    def through(self, items: Sequence[Any], batch: int | None) -> None:
        """Do all items, in batches of this size. Each present worker has some of them waiting."""
        with self._watched():
            # Jobs of a queue may begin much later: without a limit, as with any other work of Dask.
            try:
                self._client.wait_for_workers(1)
            except OSError as cause:
                raise self._disconnected() from cause
            workers = max(1, _present_workers(self._client))
            self._all(items, batch or max(1, min(_MOST_IN_BATCH, len(items) // (8 * workers))))

    @contextmanager
    def _watched(self) -> Iterator[None]:
        """Say it if there is no worker. Nothing is lost: the batches wait for workers that join."""
        ended = threading.Event()

        def watch() -> None:
            alone, say_at = 0.0, _ALONE_S
            while not ended.wait(_ALONE_S / 10):
                try:
                    workers = _present_workers(self._client)
                except (OSError, RuntimeError):  # A scheduler that is lost is reported by its batches.
                    return
                if workers:
                    alone, say_at = 0.0, _ALONE_S
                    continue
                alone += _ALONE_S / 10
                if alone >= say_at:
                    say_at = alone + min(2 * say_at, _MOST_ALONE_S)
                    _LOG.warning(self._alone(alone))

        watcher = threading.Thread(target=watch, name="abbe-fleet-workers", daemon=True)
        watcher.start()
        try:
            yield
        finally:
            ended.set()
            watcher.join(_CONNECT_S)

    def _alone(self, seconds: float) -> str:
        address = self._client.scheduler.address
        return (
            f"the scheduler {address} has had 0 workers for {seconds:.0f} s: {self._done} of {self._result.sessions} "
            f"sessions are done, the others wait; start workers with `dask worker {address} --nthreads 1`, or end the "
            "run with Ctrl-C: finished results are kept"
        )

    def _all(self, items: Sequence[Any], size: int) -> None:
        rest = iter(items)
        batches = iter(lambda: list(islice(rest, size)), [])
        self._show(0, len(items))
        waiting = _dask().as_completed([self._submit(batch) for batch in islice(batches, self._wanted())])
        try:
            for future in waiting:
                self._ended(future)
                future.release()
                for batch in islice(batches, max(0, self._wanted() - len(self._items))):
                    waiting.add(self._submit(batch))
                for item in self._next_suspects():
                    waiting.add(self._submit([item]))
                self._show(self._done, len(items))
        except KeyboardInterrupt:
            self._client.cancel(list(waiting.futures), force=True)
            raise
        shared = {id: keys for id, keys in self._keys.items() if len(keys) > 1}
        self._result.shared_ids = {id: sorted(sum(keys.values(), [])) for id, keys in sorted(shared.items())}
        self._result.failed.sort(key=lambda failure: failure.file)

    def _wanted(self) -> int:
        return _BATCHES_AHEAD * max(1, _present_workers(self._client))

    def _next_suspects(self) -> list[Any]:
        """Suspects to try alone, when all batches have ended: Dask gives up whatever waits for a worker that ends, so
        that each worker has one item at most."""
        if not self._suspects or any(items[0] not in self._tried for items in self._items.values()):
            return []
        count = max(1, _present_workers(self._client)) - len(self._items)
        return [self._suspects.popleft() for _ in range(min(count, len(self._suspects)))]

    def _ended(self, future: Future) -> None:
        """Take in a batch."""
        items = self._items.pop(future.key)
        if future.status == "finished":
            try:
                outcomes = future.result()
            except (OSError, TimeoutError) as cause:
                raise self._disconnected() from cause
            for outcome in outcomes:
                self._take(outcome)
            return
        if future.status in ("cancelled", "lost"):
            raise self._disconnected()
        why = future.exception()
        if isinstance(why, Error):
            raise Error(f"{why.message} ({self._done} of {self._result.sessions} done)")
        if not isinstance(why, _dask().KilledWorker):
            raise why
        for item in items:
            tried = self._tried[item] = self._tried.get(item, 0) + 1
            if tried <= self._retries:
                self._suspects.append(item)
            else:
                self._result.lost.append(Failure(str(item), f"its worker ended {tried} times: {why}"))
                self._done += 1

    def _take(self, outcome: Outcome) -> None:
        file, computed, text, seconds = outcome
        self._done += 1
        self._result.computed += computed
        self._result.kept += not computed
        self._result.seconds += seconds
        note = json.loads(text)
        if note["error"] is not None:
            self._result.failed.append(Failure(file, note["error"]))
        self._keys.setdefault(note["session_id"], {}).setdefault(note["key"], []).append(file)

    def _disconnected(self) -> Error:
        return Error(
            f"the scheduler was lost: {self._done} of {self._result.sessions} sessions were reported",
            help="finished results are kept; start the scheduler and run again",
        )


def _bar(done: int, all: int) -> None:
    """A bar on standard error, if that is a terminal."""
    if sys.stderr.isatty():
        filled = 40 * done // all
        end = "\n" if done == all else ""
        print(f"\r{'#' * filled}{'-' * (40 - filled)} {done} of {all} sessions", end=end, file=sys.stderr, flush=True)
