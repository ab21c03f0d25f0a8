"""Signals, threads, processes and memory."""

import multiprocessing
import signal
import subprocess
import sys
import textwrap
import threading
import time

import numpy as np
import psutil
import pytest
from conftest import MEASURED, SESSIONS

import abbe

FILE = SESSIONS / MEASURED[0]


def test_interrupts_end_a_trace():
    """Ctrl-C raises KeyboardInterrupt, wherever the trace is. docs/development/validation.md states how soon."""
    program = textwrap.dedent(f"""
        import signal, abbe
        signal.signal(signal.SIGINT, signal.default_int_handler)
        session = abbe.Session.read({str(FILE)!r})
        print("ready", flush=True)
        try:
            session.trace()
        except KeyboardInterrupt:
            # The module works on.
            print("interrupted, rank", session.plan(effects=False).rank, flush=True)
    """)
    for delay in (0.02, 0.1, 0.3):
        with subprocess.Popen([sys.executable, "-c", program], stdout=subprocess.PIPE, text=True) as child:
            assert child.stdout.readline() == "ready\n"
            time.sleep(delay)
            child.send_signal(signal.SIGINT)
            assert child.stdout.readline().startswith("interrupted, rank "), delay


def test_no_signal_handler_is_installed():
    program = "import signal; before = signal.getsignal(2); import abbe; assert signal.getsignal(2) is before"
    subprocess.run([sys.executable, "-c", program], check=True)


def test_an_exception_of_progress_ends_the_trace(measured):
    class Enough(Exception):
        pass

    def progress(words):
        raise Enough(words)

    with pytest.raises(Enough, match="fitting"):
        measured.trace(progress=progress)
    assert measured.fit().rank > 0


def test_threads_compute_at_the_same_time(measured):
    """Other threads of Python run during a computation, and each has its result."""
    ticks, fits = [], []

    def work():
        fits.append(measured.trace(only=["EZC"], max_effects=1))

    threads = [threading.Thread(target=work) for _ in range(3)]
    for thread in threads:
        thread.start()
    while any(thread.is_alive() for thread in threads):
        ticks.append(time.monotonic())
        time.sleep(0.005)
    assert len(ticks) > 20
    assert all(fit.to_dict() == fits[0].to_dict() for fit in fits) and len(fits) == 3


def test_results_do_not_depend_on_threads(measured):
    try:
        found = []
        for count in (1, 2, 5):
            abbe.set_threads(count)
            assert abbe.threads() == count
            found.append((measured.fit().to_dict(), measured.trace(only=["EZC"]).to_dict()))
        assert found[0] == found[1] == found[2]
    finally:
        abbe.set_threads()


def forked(results, session):
    results.put(session.fit().to_dict())


@pytest.mark.skipif(sys.platform != "linux", reason="processes are forked on Linux")
@pytest.mark.filterwarnings("ignore::DeprecationWarning")
def test_a_forked_process_computes(measured):
    """A forked process has none of the threads of its parent."""
    expected = measured.fit().to_dict()
    context = multiprocessing.get_context("fork")
    results = context.Queue()
    child = context.Process(target=forked, args=(results, measured))
    child.start()
    assert results.get(timeout=60) == expected
    child.join()


def test_fits_do_not_grow_memory():
    c = np.linspace(0.0, 360.0, 400)
    x, y = 0.012 - 100 * np.sin(np.radians(c)), 100 * np.cos(np.radians(c))
    process = psutil.Process()

    def fit():
        session = abbe.Session(abbe.Machine.from_code("w C A b Y X Z t"), noise_um=0.1, errors=["EX0C", "EY0C"])
        session.add_test(
            "C", c_deg=c, z_mm=75, length_mm=np.sqrt(x**2 + y**2 + 75**2),
            bar_mm=125, workpiece_ball_mm=(0, 100, 0), spindle_ball_mm=(0, 0, 0),
        )
        assert session.fit().residuals["C"].size == 400
        session.jacobian()

    for _ in range(200):
        fit()
    before = process.memory_info().rss
    for _ in range(1000):
        fit()
    assert process.memory_info().rss - before < 4 << 20
