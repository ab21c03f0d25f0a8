"""Sessions built from arrays are those read from files."""

import csv
import multiprocessing
import pickle
from pathlib import Path

import numpy as np
import pytest
from conftest import MEASURED, SESSIONS

import abbe

toml_reader = pytest.importorskip("tomllib")


def rebuilt(path: Path) -> abbe.Session:
    """A session of a file, built from its values and the columns of its CSV files, read by Python."""
    stated = toml_reader.loads(path.read_text())
    machine = stated["machine"]
    if "file" in machine:
        machine = abbe.Machine.read(path.parent / machine["file"])
    instrument = stated["instrument"]
    session = abbe.Session(
        machine,
        instrument["kind"],
        noise_um=instrument.get("noise_um"),
        resolution_um=instrument.get("resolution_um"),
        errors=stated.get("unknowns", {}).get("errors"),
        constants=stated.get("constants"),
        about=stated.get("about"),
    )
    for test in stated["test"]:
        rows = csv.DictReader(line for line in (path.parent / test.pop("data")).open() if not line.startswith("#"))
        table = list(rows)
        columns = {name: np.array([float(row[name]) for row in table]) for name in table[0]}
        session.add_test(test.pop("name"), **columns, **test)
    for effect in stated.get("effect", []):
        session.add_effect(**effect)
    return session


@pytest.mark.parametrize("name", MEASURED)
def test_sessions_from_arrays_and_files_are_equal(name):
    read, built = abbe.Session.read(SESSIONS / name), rebuilt(SESSIONS / name)
    assert built.tests == read.tests
    for test in read.tests:
        for column, values in read.readings(test).items():
            assert np.array_equal(built.readings(test)[column], values), (test, column)
    expected, found = read.fit().to_dict(), built.fit().to_dict()
    expected.pop("session")
    # Lines of outliers are those of a file.
    for outlier in [*expected.get("outliers", []), *found.get("outliers", [])]:
        outlier.pop("line", None)
    assert found == expected


def test_a_saved_session_is_read_back(tmp_path):
    session = rebuilt(SESSIONS / MEASURED[0])
    read = abbe.Session.read(session.save(tmp_path / "saved"))
    assert read.fit()["EX0C"].value == pytest.approx(session.fit()["EX0C"].value, rel=1e-9)
    with pytest.raises(FileExistsError):
        session.save(tmp_path / "saved")


def test_layouts_and_kinds_of_arrays():
    """Arrays with gaps, in other kinds of numbers and lists give the same readings."""
    degrees = np.arange(0.0, 360.0, 4.0)
    length = np.full(degrees.size, 125.0)
    whole = np.repeat(degrees, 2)[::2]
    readings = []
    for c in (degrees, whole, degrees.astype(np.int32), list(degrees), degrees.astype(np.float32)):
        session = abbe.Session(abbe.Machine.from_code("w C A b Y X Z t"), noise_um=0.3)
        session.add_test("C", c_deg=c, z_mm=75, length_mm=length, **BAR)
        readings.append(session.readings("C")["c_deg"])
    assert all(np.array_equal(found, readings[0]) for found in readings)


BAR = {"bar_mm": 125, "workpiece_ball_mm": (0, 100, 0), "spindle_ball_mm": (0, 0, 0)}


def test_a_deviation_is_from_the_bar():
    c = np.arange(0.0, 360.0)
    session = abbe.Session(abbe.Machine.from_code("w C A b Y X Z t"), noise_um=0.3)
    session.add_test("C", c_deg=c, z_mm=np.float64(75), deviation_um=np.full(360, 2.0), **BAR)
    assert session.readings("C")["reading_mm"] == pytest.approx(np.full(360, 125.002), abs=1e-12)


def test_copied_rows_are_removed_as_in_files():
    """Rows that are copied in every column are no repeats."""
    c = np.repeat(np.arange(0.0, 360.0), np.where(np.arange(360) == 7, 2, 1))
    length = 125.0 + 1e-4 * np.sin(c)
    columns = {"time_s": c, "run": np.ones(361), "c_deg": c, "length_mm": length}
    session = abbe.Session(abbe.Machine.from_code("w C A b Y X Z t"), noise_um=0.3)
    session.add_test("C", z_mm=75, **columns, **BAR)
    assert session.readings("C")["c_deg"].size == 360
    assert any("copy" in warning and "line 9" in warning for warning in session.warnings)


def test_read_only_arrays_are_read():
    c, length = np.arange(0.0, 360.0), np.full(360, 125.0)
    c.flags.writeable = length.flags.writeable = False
    session = abbe.Session(abbe.Machine.from_code("w C A b Y X Z t"), noise_um=0.3)
    session.add_test("C", c_deg=c, z_mm=75, length_mm=length, **BAR)
    assert session.fit().readings == 360


def fitted(session: abbe.Session) -> abbe.Fit:
    return session.fit()


@pytest.mark.parametrize("name", MEASURED[:2])
def test_sessions_and_results_pickle(name):
    session = abbe.Session.read(SESSIONS / name)
    with multiprocessing.get_context("spawn").Pool(1) as pool:
        (fit,) = pool.map(fitted, [session])
    own = session.fit()
    assert fit.to_dict() == own.to_dict()
    test = session.tests[0]
    assert np.array_equal(fit.residuals[test], own.residuals[test])
    assert np.array_equal(fit.estimates, own.estimates)


def test_everything_pickles(measured, chapter5):
    trace = measured.trace(only=["EZC"], max_effects=1)
    model = trace.model()
    plan = chapter5.plan(effects=False)
    for result in (trace, plan, model.validate(measured), measured.fit()["EX0C"]):
        copy = pickle.loads(pickle.dumps(result))
        assert copy.to_dict() == result.to_dict() and type(copy) is type(result)
    assert pickle.loads(pickle.dumps(model)).to_dict() == model.to_dict()
    assert pickle.loads(pickle.dumps(measured.machine)) == measured.machine
    error = pickle.loads(pickle.dumps(abbe.SessionError("message", help="help", file="f", line=1, column=2)))
    assert (str(error), error.line, error.column) == ("message\nhelp: help", 1, 2)
    planned = pickle.loads(pickle.dumps(chapter5))
    assert np.array_equal(planned.plan(effects=False).uncertainty, plan.uncertainty)
