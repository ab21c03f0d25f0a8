"""Fleets: runs on Dask, and the data set."""

import json
import subprocess

import numpy as np
import pytest
from conftest import find_command
from fleets import make, results

import abbe
import abbe.fleet

pytest.importorskip("distributed")
pytest.importorskip("duckdb")
parquet = pytest.importorskip("pyarrow.parquet")


@pytest.fixture(scope="module")
def sessions(tmp_path_factory):
    return make(tmp_path_factory.mktemp("fleet"), 24)


@pytest.fixture(scope="module")
def finished(sessions, tmp_path_factory):
    """The folder of a run by two processes."""
    out = tmp_path_factory.mktemp("results")
    run = abbe.fleet.run(sessions, out, workers=2, progress=False, trace=False)
    assert (run.sessions, run.computed, run.kept, run.failed, run.lost) == (24, 24, 0, [], [])
    return out


def test_results_are_those_of_the_command_whatever_the_workers(sessions, finished, tmp_path):
    again = abbe.fleet.run(sessions, finished, workers=1, progress=False, trace=False)
    assert (again.computed, again.kept) == (0, 24)
    done = subprocess.run(
        [find_command(), "fleet", "run", str(sessions), "--out", str(tmp_path / "command"), "--no-trace"], capture_output=True
    )
    assert done.returncode == 0, done.stderr
    assert results(finished) == results(tmp_path / "command")
    files = sorted(sessions.rglob("session.toml"), reverse=True)
    abbe.fleet.run(files, tmp_path / "one", workers=1, batch=1, progress=False, trace=False)
    assert results(finished) == results(tmp_path / "one")


def test_the_unit_of_work_is_a_pure_function(sessions, finished):
    pandas = pytest.importorskip("pandas")
    files = sorted(sessions.rglob("session.toml"))[:3]
    records = [abbe.fleet.analyse(file, trace=False) for file in files]
    for record in records:
        assert json.loads(results(finished)[record["key"] + ".json"]) == record
    options = json.dumps({"no_trace": True})
    batches = [pandas.DataFrame({"file": [str(file)], "options": [options]}) for file in files]
    frames = list(abbe.fleet.map_in_pandas(batches))
    assert [json.loads(frame["record"][0]) for frame in frames] == records
    failing = abbe.fleet.analyse(files[0].with_name("nowhere.toml"))
    assert failing["error"]["stage"] == "read" and "nowhere.toml" in failing["error"]["message"]


def test_the_dataset_has_its_schema_and_values(finished, tmp_path):
    dataset = abbe.fleet.write_dataset(finished, tmp_path / "dataset")
    assert dataset.rows["sessions"] == 24 and dataset.missing == []
    for table in abbe.fleet.SCHEMAS:
        for file in (tmp_path / "dataset" / table).rglob("*.parquet"):
            schema = parquet.read_schema(file)
            assert schema.names == list(abbe.fleet.SCHEMAS[table])
            expected = abbe.fleet._dataset.schema(table)
            assert [schema.field(name).type for name in schema.names] == [field.type for field in expected]
            assert schema.metadata[b"abbe.schema_version"] == str(abbe.fleet.SCHEMA_VERSION).encode()
    record = json.loads(next(iter(results(finished).values())))
    rows = dataset.sql(f"from parameters where key = '{record['key']}' order by position").fetchall()
    names = list(abbe.fleet.SCHEMAS["parameters"])
    found = [dict(zip(names, row)) for row in rows]
    model = record["model"]
    listed = [*model["parameters"], *model["outcome"].get("not_estimated", [])]
    assert [row["id"] for row in found] == [parameter["id"] for parameter in listed]
    covariance = np.array([row["covariance"] for row in found if row["identifiable"]])
    assert np.allclose(covariance, covariance.T)
    assert np.sqrt(np.diag(covariance)) == pytest.approx([row["u"] for row in found if row["identifiable"]])
    fit = abbe.Session.read(find_file(finished, record["key"])).fit(seed=record["seed"])
    assert fit["EX0C"].value == next(row["value"] for row in found if row["id"] == "EX0C")
    # Nothing has changed: nothing is written.
    again = abbe.fleet.write_dataset(finished, tmp_path / "dataset")
    assert (again.written, again.rows) == (0, dataset.rows)
    assert not list((tmp_path / "dataset").rglob("*.part"))


def find_file(out, key):
    for note in (out / "sessions").rglob("*.json"):
        content = json.loads(note.read_text())
        if content["key"] == key:
            return content["file"]
    raise KeyError(key)


def test_history_is_that_of_the_command(finished):
    found = abbe.fleet.history(finished)
    done = subprocess.run([find_command(), "fleet", "history", str(finished), "--json", "-"], capture_output=True, check=True)
    printed = json.loads(done.stdout)
    assert {key: printed[key] for key in found} == found
    drifting = [
        (machine["machine_id"], parameter["id"])
        for machine in found["machines"]
        for parameter in machine["parameters"]
        if parameter["drift_per_year"]
    ]
    assert drifting == [("M0", "EX0C")]
    with pytest.raises(abbe.Error, match="no session of the machine"):
        abbe.fleet.history(finished, machine="none")


def test_bad_sessions_are_isolated(tmp_path):
    sessions = make(tmp_path / "fleet", 4)
    (tmp_path / "fleet" / "m1" / "00" / "C125.csv").write_text("c_deg,length_mm\n0,many\n")
    run = abbe.fleet.run(sessions, tmp_path / "out", workers=1, progress=False, trace=False)
    assert (run.computed, len(run.failed)) == (4, 1)
    assert "C125.csv" in run.failed[0].message
    rows = abbe.fleet.write_dataset(tmp_path / "out").sql("select error_stage, error from sessions where error is not null")
    assert [stage for stage, _ in rows.fetchall()] == ["read"]


def test_dates_outside_the_calendar_are_unknown():
    from abbe.fleet import _dataset

    assert _dataset._date("0001-01-01T00:00:00+01:00") is None
    assert _dataset._month("0001-01-01T00:00:00+01:00") == "unknown"
    assert _dataset._month("2026-11-23T08:00:00+01:00") == "2026-11"
