"""The results of a fleet as a data set in Parquet.

`out/dataset/TABLE/machines=G/month=2026-11/data.parquet`: G is the first digit of the SHA-256 of the identifier of the
machine modulo four, so that a partition holds many machines. A partition is written again only if its results have
changed.
"""

from __future__ import annotations

import hashlib
import json
import os
import shutil
from collections import defaultdict
from collections.abc import Iterable
from dataclasses import dataclass
from datetime import datetime, timezone
from pathlib import Path as File
from typing import Any

from .. import _abbe
from .._errors import Error
from ._work import Path

SCHEMA_VERSION = 3
"""Version of the tables. It is in the metadata of every file (``abbe.schema_version``)."""

_GROUPS = 4
"""Groups of machines. A file for each machine and month would have some twenty rows."""

SCHEMAS: dict[str, dict[str, tuple[str, str]]] = {
    "sessions": {
        "key": ("string", "SHA-256 of all inputs, options and the build of the program"),
        "session_id": ("string", "`session_id` of `[about]`, else the session file"),
        "shared_id": ("bool", "whether sessions of different content have this identifier"),
        "file": ("string", "session file"),
        "machine_id": ("string", "`serial_number` of `[about]`, else the name of the machine"),
        "machine_name": ("string", "name of the machine"),
        "machine_code": ("string", "structural code"),
        "axes_sha256": ("string", "SHA-256 of the axes with their geometry"),
        "date": ("timestamp", "`date` of `[about]`, UTC"),
        "instrument": ("string", "instrument"),
        "error_stage": ("string", "where the analysis failed: `read`, `fit`, `trace`, `validate`"),
        "error": ("string", "why there is no result"),
        "verdict": ("string", "verdict of the trace"),
        "goodness": ("string", "whether the residual agrees with the noise: `agrees`, `exceeds`, `structured`, …"),
        "readings": ("int64", "readings without outliers"),
        "outliers": ("int64", "readings excluded as outliers"),
        "noise_um": ("double", "standard deviation of one reading"),
        "noise_source": ("string", "`stated`, `repeats` or `residual`"),
        "rms_before_um": ("double", "residual of the declared model"),
        "rms_um": ("double", "residual of the final model"),
        "heldout_rms_um": ("double", "held-out residual of the final model"),
        "rank": ("int64", "numerical rank"),
        "parameter_count": ("int64", "number of parameters"),
        "conflicts": ("int64", "set-up conflicts"),
        "validation_verdict": ("string", "verdict of the validation"),
        "validation_rms_um": ("double", "residual of the validated model"),
        "tool_version": ("string", "build of the program: version and checksum of its sources"),
        "seed": ("int64", "seed of all random numbers"),
        "warnings": ("strings", "warnings"),
    },
    "parameters": {
        "key": ("string", "key of the session"),
        "machine_id": ("string", "identifier of the machine"),
        "date": ("timestamp", "date of the session"),
        "position": ("int32", "place among the parameters of the session"),
        "id": ("string", "identifier: `EX0C`, `bar[A100]`"),
        "value": ("double", "estimate, in `unit`"),
        "u": ("double", "standard uncertainty, in `unit`"),
        "unit": ("string", "`um`, `arcsec`, …"),
        "meaning": ("string", "what the parameter is"),
        "identifiable": ("bool", "whether the readings identify it"),
        "determined_by": ("string", "`readings`, `prior`, `base-combination` or `nothing`"),
        "significant": ("bool", "whether the estimate exceeds 2u and is quotable"),
        "quotable": ("bool", "whether the estimate may be quoted with its u"),
        "covariance": ("doubles", "its row of the covariance, by `position`; the unit is that of both"),
    },
    "effects": {
        "key": ("string", "key of the session"),
        "machine_id": ("string", "identifier of the machine"),
        "machine_code": ("string", "structural code"),
        "date": ("timestamp", "date of the session"),
        "id": ("string", "identifier: `EZC~C:h2`"),
        "component": ("string", "what moves"),
        "driver": ("string", "what it follows"),
        "shape": ("string", "shape"),
        "order": ("double", "order of a harmonic, degree of a polynomial"),
        "tests": ("strings", "tests to which it is confined; empty for all"),
        "meaning": ("string", "what the effect is"),
        "family": ("string", "family of the library"),
        "p_value": ("double", "probability that the search finds as much without structure"),
        "rms_gain_um": ("double", "rms that the effect explains"),
        "is_unique": ("bool", "whether no other effect explains the readings as well"),
        "aliases": ("strings", "effects that explain the readings as well, nearest first"),
        "alias_set": ("strings", "the effect and its aliases, sorted; another name of a fault may have another set"),
    },
}
"""The columns of each table: type and meaning."""


@dataclass
class Dataset:
    """A data set on disk."""

    path: str
    """Its folder."""
    rows: dict[str, int]
    """Rows of each table."""
    written: int
    """Files that were written."""
    kept: int
    """Files that were up to date."""
    missing: list[str]
    """Session files whose result is missing: run again."""

    def sql(self, query: str) -> Any:
        """Return the relation of a query of DuckDB over ``sessions``, ``parameters`` and ``effects``.

        Parameters
        ----------
        query : str
            The query.
        """
        return connect(self.path).sql(query)


def connect(path: Path) -> Any:
    """A connection of DuckDB with the tables of a data set as views."""
    try:
        import duckdb
    except ImportError as cause:
        raise Error("queries need DuckDB", help="pip install abbe[fleet]") from cause
    connection = duckdb.connect()
    for table in SCHEMAS:
        place = str(File(path, table, "*", "*", "data.parquet")).replace("'", "''")
        connection.execute(
            f"create view {table} as select * from read_parquet('{place}', hive_partitioning = true, "
            "hive_types = {'machines': varchar, 'month': varchar})"
        )
    return connection


def _arrow() -> Any:
    try:
        import pyarrow
        import pyarrow.parquet
    except ImportError as cause:
        raise Error("a data set needs PyArrow", help="pip install abbe[fleet]") from cause
    return pyarrow


def schema(table: str) -> Any:
    """The schema of a table for PyArrow, with the meanings of the columns."""
    arrow = _arrow()
    types = {
        "string": arrow.string(),
        "bool": arrow.bool_(),
        "int32": arrow.int32(),
        "int64": arrow.int64(),
        "double": arrow.float64(),
        "timestamp": arrow.timestamp("us"),
        "strings": arrow.list_(arrow.string()),
        "doubles": arrow.list_(arrow.float64()),
    }
    fields = [
        arrow.field(name, types[kind], metadata={"meaning": meaning})
        for name, (kind, meaning) in SCHEMAS[table].items()
    ]
    return arrow.schema(fields)


def write_dataset(out: Path, path: Path | None = None) -> Dataset:
    """Write the results of a folder as a data set in Parquet.

    Each file is written completely or not at all. Files whose results have not changed stay.

    Parameters
    ----------
    out : path-like
        The folder of :func:`run`.
    path : path-like, optional
        Folder of the data set; ``dataset`` in `out` by default.

    Returns
    -------
    Dataset
        The data set, with a method for queries.
    """
    texts, missing = _abbe.fleet_records(out)
    # Copies of a session have one key, and one row: that of the first file.
    by_key: dict[str, tuple[dict[str, Any], dict[str, Any]]] = {}
    for note_text, record_text in texts:
        pair = (json.loads(note_text), json.loads(record_text))
        by_key.setdefault(pair[0]["key"], pair)
    pairs = list(by_key.values())
    target = File(path) if path is not None else File(out) / "dataset"
    keys_of = defaultdict(set)
    for note, record in pairs:
        keys_of[note["session_id"]].add(note["key"])
    shared = {id for id, keys in keys_of.items() if len(keys) > 1}
    partitions: dict[tuple[str, str], list[tuple[dict[str, Any], dict[str, Any]]]] = defaultdict(list)
    for pair in pairs:
        partitions[_group(pair[1]["machine_id"]), _month(pair[1]["date"])].append(pair)
    dataset = Dataset(str(target), dict.fromkeys(SCHEMAS, 0), 0, 0, missing)
    for table in SCHEMAS:
        known = set()
        for (group, month), own in partitions.items():
            own.sort(key=lambda pair: (pair[1]["machine_id"], pair[1]["date"] or "", pair[0]["file"]))
            place = target / table / f"machines={group}" / f"month={month}" / "data.parquet"
            known.add(place)
            _write(place, table, own, shared, dataset)
        # Partitions of sessions that are no longer there. A missing result is no reason to remove what it was.
        if missing:
            continue
        for place in (target / table).glob("machines=*/month=*/data.parquet"):
            if place not in known:
                shutil.rmtree(place.parent)
    return dataset


def _group(machine_id: str) -> str:
    return str(int(hashlib.sha256(machine_id.encode()).hexdigest()[0], 16) % _GROUPS)


def _date(text: str | None) -> datetime | None:
    """A date of TOML, in UTC without a zone, which DuckDB returns without a further package; none for other forms."""
    if text is None:
        return None
    try:
        date = datetime.fromisoformat(text.strip().replace("Z", "+00:00").replace("z", "+00:00"))
        return date.astimezone(timezone.utc).replace(tzinfo=None) if date.tzinfo else date
    except (ValueError, OverflowError):  # 0001-01-01T00:00:00+01:00 is before the first date in UTC.
        return None


def _month(text: str | None) -> str:
    date = _date(text)
    return "unknown" if date is None else f"{date:%Y-%m}"


def _write(
    place: File,
    table: str,
    pairs: list[tuple[dict[str, Any], dict[str, Any]]],
    shared: set[str],
    dataset: Dataset,
) -> None:
    """Write a partition, unless the file holds just these results."""
    arrow = _arrow()
    stated = [(note["file"], note["key"], note["session_id"] in shared) for note, _ in pairs]
    content = hashlib.sha256(json.dumps([SCHEMA_VERSION, stated]).encode()).hexdigest()
    try:
        found = arrow.parquet.read_metadata(place)
        if (found.metadata or {}).get(b"abbe.content") == content.encode():
            dataset.kept += 1
            dataset.rows[table] += found.num_rows
            return
    except (OSError, arrow.ArrowInvalid):
        pass
    rows = [row for note, record in pairs for row in _rows(table, note, record, shared)]
    metadata = {"abbe.schema_version": str(SCHEMA_VERSION), "abbe.content": content}
    own = arrow.Table.from_pylist(rows, schema=schema(table)).replace_schema_metadata(metadata)
    place.parent.mkdir(parents=True, exist_ok=True)
    part = place.with_name(f".data.{os.getpid()}.part")
    try:
        arrow.parquet.write_table(own, part, compression="zstd")
        os.replace(part, place)
    except OSError as cause:
        raise Error(f"{place}: cannot be written: {cause}", help="free space and write the data set again") from cause
    finally:
        part.unlink(missing_ok=True)
    dataset.written += 1
    dataset.rows[table] += len(rows)


def _rows(
    table: str, note: dict[str, Any], record: dict[str, Any], shared: set[str]
) -> Iterable[dict[str, Any]]:
    """The rows of a session in a table."""
    machine, model = record["machine"] or {}, record["model"] or {}
    outcome = model.get("outcome", {})
    own = {"key": record["key"], "machine_id": record["machine_id"], "date": _date(record["date"])}
    if table == "sessions":
        error, validation = record["error"] or {}, record["validation"] or {}
        yield {
            **{name: record.get(name, model.get(name)) for name in SCHEMAS["sessions"]},
            **own,
            "goodness": outcome["goodness"]["verdict"] if model else None,
            "outliers": len(model["outliers"]) if model else None,
            "session_id": note["session_id"],
            "shared_id": note["session_id"] in shared,
            "file": note["file"],
            "machine_name": machine.get("name"),
            "machine_code": machine.get("code"),
            "axes_sha256": machine.get("sha256"),
            "error_stage": error.get("stage"),
            "error": error.get("message"),
            "validation_verdict": validation.get("verdict"),
            "validation_rms_um": validation.get("rms_um"),
        }
    elif table == "parameters":
        matrix = model.get("covariance", {}).get("matrix", [])
        found = [
            {**parameter, "identifiable": True, "covariance": row}
            for parameter, row in zip(model.get("parameters", []), matrix)
        ]
        without = {"identifiable": False, "significant": False, "quotable": False}
        found += [{**parameter, **without} for parameter in outcome.get("not_estimated", [])]
        for position, parameter in enumerate(found):
            yield {**own, **parameter, "position": position}
    else:
        for effect in record["effects"]:
            yield {
                **own,
                "tests": [],
                **effect,
                "machine_code": machine.get("code"),
                "is_unique": effect["unique"],
                "alias_set": sorted({effect["id"], *effect["aliases"]}),
            }
