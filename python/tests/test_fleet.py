"""Fleets: runs on Dask, the data set, the queries of the documentation."""

import json
import os
import re
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from conftest import SESSIONS, find_command

import abbe
import abbe.fleet

distributed = pytest.importorskip("distributed")
duckdb = pytest.importorskip("duckdb")
parquet = pytest.importorskip("pyarrow.parquet")

GUIDE = Path(__file__).parent.parent.parent / "docs" / "guide" / "fleet.md"


def make(folder, count, machines=4):
    """Small simulated sessions of some machines, one a month."""
    plan = abbe.Session.read(SESSIONS / "hermle-c600u" / "chapter5.toml")
    for number in range(count):
        machine, month = number % machines, number // machines
        session = abbe.Session(
            plan.machine,
            noise_um=0.3,
            errors=["EX0C", "EY0C"],
            about={
                "serial_number": f"M{machine}",
                "date": f"{2024 + month // 12}-{month % 12 + 1:02}-05T08:00:00",
            },
        )
        session.add_test(
            "C125", bar_mm=125, workpiece_ball_mm=(0, 100, 0), spindle_ball_mm=(0, 0, 0), z_mm=75,
            sweep={"axis": "C", "from_deg": 0, "to_deg": 360, "step_deg": 4},
        )  # fmt: skip
        drift = 0.4 * month if machine == 0 else 0.0
        measured = session.simulate({"EX0C": 10.0 + drift, "EY0C": -5.0}, seed=number + 1)
        (folder / f"m{machine}").mkdir(parents=True, exist_ok=True)
        measured.save(folder / f"m{machine}" / f"{month:02}")
    return folder


def results(out):
    return {file.name: file.read_bytes() for file in sorted((out / "results").rglob("*.json"))}


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
        [find_command(), "run", str(sessions), "--out", str(tmp_path / "command"), "--no-trace"], capture_output=True
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
    assert [row["id"] for row in found] == [parameter["id"] for parameter in record["parameters"]]
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


def queries():
    """The queries of the guide, by the question in front of each."""
    text = GUIDE.read_text(encoding="utf-8")
    return re.findall(r"\n\*\*(.+?)\*\*\n\n```sql\n(.*?)```", text, re.DOTALL)


def test_there_are_ten_queries():
    assert len(queries()) == 10


@pytest.mark.parametrize("question, query", queries())
def test_queries_of_the_guide(finished, question, query):
    dataset = abbe.fleet.write_dataset(finished)
    rows = dataset.sql(query).fetchall()
    if "drift" in question.lower():
        assert rows[0][0] == "M0", "the machine that drifts"
    if "effect" not in question.lower() and "fault" not in question.lower() and "fail" not in question.lower():
        assert rows


def test_history_is_that_of_the_command(finished):
    found = abbe.fleet.history(finished)
    done = subprocess.run([find_command(), "history", str(finished), "--json", "-"], capture_output=True, check=True)
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


def test_an_unreachable_scheduler_is_named(sessions, tmp_path, monkeypatch):
    monkeypatch.setattr("abbe.fleet._run._CONNECT_S", 2.0)
    with pytest.raises(abbe.Error, match="127.0.0.1:1 cannot be reached"):
        abbe.fleet.run(sessions, tmp_path, client="tcp://127.0.0.1:1", progress=False)


class Cluster:
    """A scheduler and workers as processes of their own."""

    def __init__(self, port):
        self.address = f"tcp://127.0.0.1:{port}"
        self.port = port
        self.processes = []

    def start(self, module, *arguments):
        line = [sys.executable, "-m", "distributed.cli." + module, *map(str, arguments)]
        process = subprocess.Popen(line, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        self.processes.append(process)
        return process

    def scheduler(self):
        return self.start("dask_scheduler", "--host", "127.0.0.1", "--port", self.port, "--no-dashboard")

    def worker(self):
        return self.start("dask_worker", self.address, "--nthreads", 1, "--no-nanny", "--no-dashboard")

    def end(self):
        for process in self.processes:
            process.kill()
            process.wait()


@pytest.fixture
def cluster():
    own = Cluster(20000 + os.getpid() % 20000)
    yield own
    own.end()


RUN = """
import sys, abbe, abbe.fleet
run = abbe.fleet.run(sys.argv[1], sys.argv[2], client=sys.argv[3], batch=2, progress=False, only=["EX0", "EXC"])
print(run.computed, run.kept, len(run.lost))
"""


def test_killed_workers_and_schedulers_lose_nothing(tmp_path, cluster):
    count = 40
    sessions, out = make(tmp_path / "fleet", count), tmp_path / "out"

    def start():
        line = [sys.executable, "-c", RUN, str(sessions), str(out), cluster.address]
        return subprocess.Popen(line, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)

    def done():
        return len(list((out / "results").rglob("*.json"))) if (out / "results").is_dir() else 0

    def wait(condition, seconds=90):
        end = time.monotonic() + seconds
        while not condition():
            assert time.monotonic() < end, "nothing goes on"
            time.sleep(0.02)

    scheduler = cluster.scheduler()
    first, _ = cluster.worker(), cluster.worker()
    run = start()
    wait(lambda: done() >= 4 or run.poll() is not None)
    first.send_signal(signal.SIGKILL)
    wait(lambda: done() >= 12 or run.poll() is not None)
    scheduler.send_signal(signal.SIGKILL)
    scheduler.wait()
    run.kill()
    run.wait()
    time.sleep(0.5)
    before = done()
    assert 0 < before < count, "the kill came too late to tell anything"

    cluster.end()
    cluster.scheduler()
    cluster.worker()
    run = start()
    output, errors = run.communicate(timeout=180)
    assert run.returncode == 0, errors
    computed, kept, lost = map(int, output.split())
    assert (computed, kept, lost) == (count - before, before, 0)
    texts = results(out)
    assert len(texts) == count
    for text in texts.values():
        json.loads(text)
    assert abbe.fleet.write_dataset(out).rows["sessions"] == count


def test_ctrl_c_keeps_finished_results(tmp_path):
    count = 40
    sessions, out = make(tmp_path / "fleet", count), tmp_path / "out"
    line = RUN.replace("client=sys.argv[3]", "workers=1")
    run = subprocess.Popen(
        [sys.executable, "-c", f"if __name__ == '__main__':\n{line.replace(chr(10), chr(10) + '    ')}", sessions, out],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        start_new_session=True,
    )
    end = time.monotonic() + 90
    while not (out / "results").is_dir() and time.monotonic() < end:
        time.sleep(0.02)
    run.send_signal(signal.SIGINT)
    run.communicate(timeout=60)
    assert run.returncode != 0
    kept = len(results(out))
    assert 0 < kept <= count
    again = abbe.fleet.run(sessions, out, workers=1, progress=False, only=["EX0", "EXC"])
    assert (again.computed, again.kept) == (count - kept, kept)


def test_dates_outside_the_calendar_are_unknown():
    from abbe.fleet import _dataset

    assert _dataset._date("0001-01-01T00:00:00+01:00") is None
    assert _dataset._month("0001-01-01T00:00:00+01:00") == "unknown"
    assert _dataset._month("2026-11-23T08:00:00+01:00") == "2026-11"
