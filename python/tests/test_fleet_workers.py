"""Runs whose workers, scheduler or user end them, or that have no workers."""

import json
import os
import signal
import socket
import subprocess
import sys
import threading
import time

import pytest
from fleets import make, results

import abbe
import abbe.fleet

pytest.importorskip("distributed")
pytest.importorskip("pyarrow")


class Cluster:
    """A scheduler and workers as processes of their own."""

    def __init__(self, port):
        self.address = f"tcp://127.0.0.1:{port}"
        self.port = port
        self.processes = []
        self.threads = []
        self.ended = threading.Event()

    def start(self, module, *arguments, **variables):
        line = [sys.executable, "-m", "distributed.cli." + module, *map(str, arguments)]
        environment = {**os.environ, **variables}
        process = subprocess.Popen(line, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, env=environment)
        self.processes.append(process)
        return process

    def scheduler(self, **variables):
        arguments = ["--host", "127.0.0.1", "--port", self.port, "--no-dashboard"]
        return self.start("dask_scheduler", *arguments, **variables)

    def worker(self, *arguments):
        line = [self.address, "--nthreads", 1, "--no-dashboard", "--no-nanny", *arguments]
        return self.start("dask_worker", *line)

    def workers(self, *arguments):
        """Workers one after the other: when one has ended, the next begins. Dask's nanny starts no other worker if one
        is killed before the nanny has seen that it runs."""

        def follow():
            while not self.ended.is_set():
                self.worker(*arguments).wait()

        thread = threading.Thread(target=follow)
        self.threads.append(thread)
        thread.start()

    def end(self):
        self.ended.set()
        self.stop()
        for thread in self.threads:
            thread.join(0.5)
        # A worker that began while the others were stopped.
        self.stop()
        for thread in self.threads:
            thread.join()
        self.ended.clear()

    def stop(self):
        for process in list(self.processes):
            process.terminate()
            try:
                process.wait(timeout=10)
            except subprocess.TimeoutExpired:
                process.kill()
                process.wait()


@pytest.fixture
def cluster():
    own = Cluster(20000 + os.getpid() % 20000)
    yield own
    own.end()


RUN = """
import sys, abbe, abbe.fleet
abbe.fleet._run._ALONE_S = 1.0
run = abbe.fleet.run(sys.argv[1], sys.argv[2], client=sys.argv[3], batch=2, progress=False, only=["EX0", "EXC"])
print(run.computed, run.kept, len(run.lost))
"""


def start(sessions, out, client, code=RUN):
    line = [sys.executable, "-c", code, str(sessions), str(out), client]
    return subprocess.Popen(line, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, start_new_session=True)


def done(out):
    return len(list((out / "results").rglob("*.json"))) if (out / "results").is_dir() else 0


def wait(condition, seconds=90):
    end = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < end, "nothing goes on"
        time.sleep(0.02)


def counts(run):
    """What a run of `RUN` prints: computed, kept and lost sessions."""
    output, errors = run.communicate(timeout=180)
    assert run.returncode == 0, errors
    return tuple(map(int, output.split()))


def test_a_scheduler_that_cannot_be_reached_is_named(tmp_path, monkeypatch):
    sessions = make(tmp_path / "fleet", 1)
    monkeypatch.setattr("abbe.fleet._run._CONNECT_S", 2.0)
    with socket.create_server(("127.0.0.1", 0)) as silent, socket.create_server(("127.0.0.1", 0)) as other:

        def speak():
            with other.accept()[0] as connection:
                connection.sendall(b"SSH-2.0-OpenSSH_9.2\r\n" * 10)
                connection.recv(1000)

        threading.Thread(target=speak, daemon=True).start()
        for port in (1, silent.getsockname()[1], other.getsockname()[1]):
            begin = time.monotonic()
            with pytest.raises(abbe.Error, match=f"the scheduler tcp://127.0.0.1:{port} cannot be reached: .") as found:
                abbe.fleet.run(sessions, tmp_path / "out", client=f"tcp://127.0.0.1:{port}", progress=False)
            assert "dask scheduler" in found.value.help
            assert time.monotonic() - begin < 20


def test_killed_workers_and_schedulers_lose_nothing(tmp_path, cluster):
    count = 40
    sessions, out = make(tmp_path / "fleet", count), tmp_path / "out"
    scheduler = cluster.scheduler()
    first, _ = cluster.worker(), cluster.worker()
    run = start(sessions, out, cluster.address)
    wait(lambda: done(out) >= 4 or run.poll() is not None)
    first.send_signal(signal.SIGKILL)
    wait(lambda: done(out) >= 12 or run.poll() is not None)
    scheduler.send_signal(signal.SIGKILL)
    scheduler.wait()
    run.kill()
    run.wait()
    time.sleep(0.5)
    before = done(out)
    assert 0 < before < count, "the kill came too late to tell anything"

    cluster.end()
    cluster.scheduler()
    cluster.worker()
    assert counts(start(sessions, out, cluster.address)) == (count - before, before, 0)
    texts = results(out)
    assert len(texts) == count
    for text in texts.values():
        json.loads(text)
    assert abbe.fleet.write_dataset(out).rows["sessions"] == count


def test_a_run_without_workers_says_so_and_goes_on_when_one_joins(tmp_path, cluster):
    count = 6
    sessions, out = make(tmp_path / "fleet", count), tmp_path / "out"
    cluster.scheduler()
    run = start(sessions, out, cluster.address)
    begin = time.monotonic()
    # The times from message to message grow.
    for line in (run.stderr.readline(), run.stderr.readline()):
        assert f"the scheduler {cluster.address} has had 0 workers for " in line
        assert f"0 of {count} sessions are done" in line
        assert f"dask worker {cluster.address} --nthreads 1" in line and "finished results are kept" in line
    assert 2.0 < time.monotonic() - begin < 60
    cluster.worker()
    assert counts(run) == (count, 0, 0)


def test_ctrl_c_ends_a_run_whose_workers_have_left(tmp_path, cluster):
    count = 40
    sessions, out = make(tmp_path / "fleet", count), tmp_path / "out"
    cluster.scheduler()
    worker = cluster.worker()
    run = start(sessions, out, cluster.address)
    wait(lambda: done(out) >= 4 or run.poll() is not None)
    worker.kill()
    worker.wait()
    kept = done(out)
    assert 0 < kept < count
    # Dask may log before that the result of a finished batch was lost with the worker.
    assert any("has had 0 workers" in line for line in run.stderr)
    run.send_signal(signal.SIGINT)
    _, errors = run.communicate(timeout=60)
    assert run.returncode != 0 and "KeyboardInterrupt" in errors
    cluster.worker()
    assert counts(start(sessions, out, cluster.address)) == (count - kept, kept, 0)


ENDS = """
import os, signal
from abbe.fleet import _work


def dask_setup(worker):
    run_session = _work._abbe.run_session

    def ends(file, *rest):
        if "m1/00" in file:
            os.kill(os.getpid(), signal.SIGKILL)
        return run_session(file, *rest)

    _work._abbe.run_session = ends
"""


def test_a_session_that_ends_its_workers_is_lost_and_the_others_are_not(tmp_path, cluster):
    count = 8
    sessions, out = make(tmp_path / "fleet", count), tmp_path / "out"
    (tmp_path / "ends.py").write_text(ENDS)
    # Dask gives a batch up after the first worker that ends during it.
    cluster.scheduler(DASK_DISTRIBUTED__SCHEDULER__ALLOWED_FAILURES="0")
    cluster.workers("--preload", tmp_path / "ends.py")
    begin = time.monotonic()
    run = abbe.fleet.run(sessions, out, client=cluster.address, batch=4, retries=1, progress=False, trace=False)
    assert time.monotonic() - begin < 90
    (lost,) = run.lost
    assert lost.file == str(sessions / "m1" / "00" / "session.toml")
    assert "its worker ended 2 times" in lost.message
    # Those of the batch that were done before its worker ended are kept.
    assert (run.sessions, run.computed + run.kept, run.failed) == (count, count - 1, [])
    assert done(out) == count - 1
    # A run by healthy workers computes what is missing.
    again = abbe.fleet.run(sessions, out, workers=1, progress=False, trace=False)
    assert (again.computed, again.kept, again.lost) == (1, count - 1, [])


def test_ctrl_c_keeps_finished_results(tmp_path):
    count = 40
    sessions, out = make(tmp_path / "fleet", count), tmp_path / "out"
    line = RUN.replace("client=sys.argv[3]", "workers=1").replace("\n", "\n    ")
    run = start(sessions, out, "", f"if __name__ == '__main__':\n{line}")
    wait((out / "results").is_dir)
    run.send_signal(signal.SIGINT)
    run.communicate(timeout=60)
    assert run.returncode != 0
    kept = len(results(out))
    assert 0 < kept <= count
    again = abbe.fleet.run(sessions, out, workers=1, progress=False, only=["EX0", "EXC"])
    assert (again.computed, again.kept) == (count - kept, kept)
