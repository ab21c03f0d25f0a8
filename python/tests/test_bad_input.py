"""Arguments that cannot be used: an exception that names the argument and what was expected."""

import numpy as np
import pytest
from conftest import SESSIONS

import abbe

C = np.arange(0.0, 360.0)
ENDLESS: list = []
ENDLESS.append(ENDLESS)
LENGTH = np.full(360, 125.0)
BAR = {"bar_mm": 125, "workpiece_ball_mm": (0, 100, 0), "spindle_ball_mm": (0, 0, 0), "z_mm": 75}


@pytest.fixture
def session():
    return abbe.Session(abbe.Machine.from_code("w C A b Y X Z t"), noise_um=0.3)


def nan(column):
    return np.where(np.arange(360) == 7, np.nan, column)


@pytest.mark.parametrize(
    ("keywords", "words"),
    [
        ({"c_deg": C.astype(complex), "length_mm": LENGTH}, ["`c_deg`", "complex128", "numbers are expected"]),
        ({"c_deg": C.astype(object), "length_mm": LENGTH}, ["`c_deg`", "object", "numbers are expected"]),
        ({"c_deg": C.astype(str), "length_mm": LENGTH}, ["`c_deg`", "numbers are expected"]),
        ({"c_deg": C.reshape(2, 180), "length_mm": LENGTH}, ["`c_deg`", "2 dimensions"]),
        ({"c_deg": nan(C), "length_mm": LENGTH}, ["c_deg", "NaN", "item 7"]),
        ({"c_deg": C, "length_mm": nan(LENGTH)}, ["length_mm", "NaN", "item 7"]),
        ({"c_deg": C, "length_mm": LENGTH * np.inf}, ["length_mm", "inf"]),
        ({"c_deg": C, "length_mm": LENGTH[:-1]}, ["`length_mm` has 359 values", "`c_deg` has 360"]),
        ({"q_deg": C, "length_mm": LENGTH}, ["unknown column `q_deg`", "c_deg"]),
        ({"c_grad": C, "length_mm": LENGTH}, ["unknown column `c_grad`", "c_deg"]),
        ({"c_deg": C, "length_furlong": LENGTH}, ["unknown column `length_furlong`", "length_mm"]),
        ({"c_deg": C, "length_mm": LENGTH, "x_deg": 3.0}, ["unknown position `x_deg`", "x_mm"]),
        ({"c_deg": C, "length_mm": LENGTH, "q_mm": 3.0}, ["`q_mm`", "neither"]),
        ({"c_deg": C, "length_mm": LENGTH, "C_rad": C}, ["`c_deg` and `C_rad`", "same meaning"]),
        ({"c_deg": C, "length_mm": LENGTH, "run": C + 0.5}, ["`run`", "run number"]),
        ({"c_deg": C, "length_mm": LENGTH, "time_s": -C}, ["`time_s`", "decreases"]),
        ({"c_deg": C[:0], "length_mm": LENGTH[:0]}, ["0 readings"]),
        ({"c_deg": C[:1], "length_mm": LENGTH[:1]}, ["1 readings"]),
        ({"length_mm": LENGTH}, ["no column with the position of an axis"]),
        ({"c_deg": C}, ["no column with the bar readings", "length_mm"]),
        ({}, ["neither data nor a motion"]),
        ({"c_deg": C, "length_mm": LENGTH, "bar_mm": -1}, ["`bar_mm`"]),
        ({"c_deg": C, "length_mm": LENGTH, "bar_mm": "long"}, ["`bar_mm`", "long"]),
        ({"c_deg": C, "length_mm": LENGTH, "bar_mm": object()}, ["`bar_mm`", "object"]),
        ({"c_deg": C, "length_mm": LENGTH, "bar_mm": 10**30}, ["`bar_mm`", "too large"]),
        ({"c_deg": C, "length_mm": LENGTH, "workpiece_ball_mm": (0, 100)}, ["`workpiece_ball_mm`", "three"]),
        ({"c_deg": C, "length_mm": LENGTH, "setup": 3}, ["`setup`"]),
        ({"c_deg": C, "length_mm": LENGTH, "workpiece_ball_mm": ENDLESS}, ["`workpiece_ball_mm`", "80 lists"]),
        ({"c_deg": C, "length_mm": LENGTH, "target_mm": (0, 0, 0)}, ["target_mm"]),
        ({"c_deg": C, "length_mm": LENGTH * 2}, ["read 250.000 mm"]),
    ],
)
def test_tests(session, keywords, words):
    with pytest.raises(abbe.SessionError) as caught:
        session.add_test("C", **{**BAR, **keywords})
    for word in words:
        assert word in str(caught.value), str(caught.value)
    assert session.tests == ()


def test_a_missing_key(session):
    with pytest.raises(abbe.SessionError, match="no `bar_mm`"):
        session.add_test("C", c_deg=C, length_mm=LENGTH, z_mm=75)


def test_a_name_twice(session):
    session.add_test("C", c_deg=C, length_mm=LENGTH, **BAR)
    with pytest.raises(abbe.SessionError, match='two tests have the name "C"'):
        session.add_test("C", c_deg=C, length_mm=LENGTH, **BAR)
    with pytest.raises(abbe.SessionError, match="without a name"):
        session.add_test(" ", c_deg=C, length_mm=LENGTH, **BAR)
    assert session.tests == ("C",)


def test_sessions():
    machine = abbe.Machine.from_code("w C A b Y X Z t")
    with pytest.raises(abbe.SessionError, match="`kind`"):
        abbe.Session(machine, "ruler")
    with pytest.raises(abbe.SessionError, match="negative"):
        abbe.Session(machine, noise_um=-1)
    with pytest.raises(abbe.SessionError, match="EX0Q"):
        abbe.Session(machine, errors=["EX0Q"])
    with pytest.raises(abbe.SessionError, match="cannot be read"):
        abbe.Session.read("does-not-exist.toml")
    with pytest.raises(abbe.SessionError, match="does not end"):
        abbe.Machine.from_code("w C b")


def test_a_session_without_readings(chapter5):
    with pytest.raises(abbe.IdentificationError, match="no readings"):
        chapter5.fit()
    with pytest.raises(abbe.Error, match="no readings"):
        chapter5.save("nowhere")


def test_names(measured, chapter5):
    fit = measured.fit()
    with pytest.raises(KeyError, match="EX0C"):
        fit["EX9C"]
    with pytest.raises(KeyError, match="C150"):
        fit.residuals["C151"]
    with pytest.raises(abbe.SessionError, match="C151"):
        chapter5.plan(effects=False).sensitivity("C151")
    with pytest.raises(abbe.SessionError, match="C151"):
        chapter5.equation("C151")
    with pytest.raises(abbe.SessionError, match="EX9C"):
        measured.predict({"EX9C": 1.0})
    with pytest.raises(abbe.SessionError, match="3 parameters"):
        measured.predict([1.0, 2.0, 3.0])
    with pytest.raises(abbe.SessionError, match="NaN"):
        measured.predict(np.full(len(measured.parameters), np.nan))
    with pytest.raises(abbe.Error, match="EX0Q"):
        chapter5.simulate({"EX0Q": 1.0})
    with pytest.raises(abbe.SessionError, match="number with a unit"):
        chapter5.simulate({"EX0C": "much"})
    with pytest.raises(abbe.Error, match="ZZZ"):
        measured.trace(only=["ZZZ"])
    with pytest.raises(TypeError, match="only"):
        measured.trace(only="EZC")
    with pytest.raises(abbe.SessionError, match="`noise_um`"):
        chapter5.plan(noise_um=0.0)
    with pytest.raises(ValueError, match="threads"):
        abbe.set_threads(0)


def test_commands(measured):
    model = measured.fit().model()
    with pytest.raises(abbe.SessionError, match="`positions` has 2 columns"):
        model.compensate(np.zeros((3, 2)))
    with pytest.raises(abbe.SessionError, match="`q_mm`"):
        model.compensate({"q_mm": [1.0]})
    with pytest.raises(abbe.Error, match="model"):
        abbe.Model.read(SESSIONS / "hermle-c600u" / "machine.toml")


def test_results_do_not_change(measured):
    fit = measured.fit()
    with pytest.raises(AttributeError):
        fit.rms_um = 0.0
    fit.to_dict()["parameters"].clear()
    assert fit.to_dict()["parameters"]
