"""Constructors accept what a user tries first: a structural code, a path, tables. Otherwise they say which call to use."""

from pathlib import Path

import numpy as np
import pytest
from conftest import MEASURED, SESSIONS

import abbe

CODE = "w C A b Y X Z t"
FILE = SESSIONS / MEASURED[0]
MACHINE = FILE.parent / "machine.toml"
TABLES = {"name": "Table", "chain": "w C b Z t", "axis": {"C": {"direction": [0, 0, 1]}, "Z": {"direction": [0, 0, 1]}}}


def test_a_machine_of_a_code_a_path_tables_or_a_machine():
    machine = abbe.Machine(CODE)
    assert machine == abbe.Machine.from_code(CODE) == abbe.Machine(machine)
    read = abbe.Machine.read(MACHINE)
    assert abbe.Machine(MACHINE) == abbe.Machine(str(MACHINE)) == read
    table = abbe.Machine(TABLES)
    assert (table.name, table.axes) == ("Table", ("C", "Z"))
    assert abbe.Machine.from_toml(table.to_toml()) == table


def test_a_session_of_a_path_or_tables():
    read = abbe.Session.read(FILE)
    for source in (FILE, str(FILE)):
        session = abbe.Session(source)
        assert session.tests == read.tests and session.noise_um == read.noise_um
        assert (session.observed == read.observed).all()
    session = abbe.Session({"machine": TABLES, "instrument": {"kind": "ballbar", "noise_um": 0.3}})
    assert (session.machine.name, session.noise_um, session.tests) == ("Table", 0.3, ())
    session = abbe.Session({"machine": {"file": str(MACHINE)}, "instrument": {"kind": "r-test"}})
    assert session.machine == abbe.Machine(MACHINE) and session.instrument == "r-test"


def test_the_tables_of_a_session_have_its_tests_and_effects():
    c = np.arange(0.0, 360.0, 10.0)
    bar = {"bar_mm": 125, "workpiece_ball_mm": [0, 100, 0], "spindle_ball_mm": [0, 0, 0], "z_mm": 75}
    session = abbe.Session(
        {
            "machine": CODE,
            "instrument": {"kind": "ballbar"},
            "test": [{"name": "C", "c_deg": c, "length_mm": np.full(36, 125.0), **bar}],
            "effect": [{"component": "EZC", "driver": "C", "shape": "harmonic", "order": 2}],
        }
    )
    assert session.tests == ("C",) and session.effects == ("EZC~C:h2",)
    assert session.readings("C")["c_deg"] == pytest.approx(c)


def test_a_session_of_a_machine_or_its_code():
    machine = abbe.Machine(CODE)
    for source in (machine, CODE):
        session = abbe.Session(source, noise_um=0.3)
        assert session.machine == machine and session.instrument == "ballbar" and session.noise_um == 0.3
    assert abbe.Session(TABLES, "r-test").machine == abbe.Machine(TABLES)


def test_a_model_of_a_path(tmp_path, measured):
    model = measured.fit().model()
    model.save(tmp_path / "model.json")
    for source in (tmp_path / "model.json", str(tmp_path / "model.json")):
        assert abbe.Model(source).to_dict() == model.to_dict()


@pytest.mark.parametrize(
    ("call", "kind", "words"),
    [
        (lambda: abbe.Machine(3), TypeError, ["structural code", "path of a machine file", "int", "Machine.from_toml"]),
        (lambda: abbe.Machine(None), TypeError, ["structural code", "NoneType"]),
        (lambda: abbe.Machine("w C A b Y X Q t"), abbe.SessionError, ["`Q`", "ISO 841"]),
        (lambda: abbe.Machine("missing.toml"), (abbe.SessionError, OSError), ["missing.toml"]),
        (lambda: abbe.Machine(Path("missing.toml")), (abbe.SessionError, OSError), ["missing.toml"]),
        (lambda: abbe.Machine({"chain": "w C b"}), abbe.SessionError, ["does not end"]),
        (lambda: abbe.Session(3), TypeError, ["Machine", "structural code", "session file", "int"]),
        (lambda: abbe.Session(FILE, noise_um=0.3), TypeError, ["a session file states", "Session(Machine(path), ...)"]),
        (lambda: abbe.Session(str(FILE), "ballbar"), TypeError, ["a session file states"]),
        (lambda: abbe.Session("missing.toml"), (abbe.SessionError, OSError), ["missing.toml"]),
        (lambda: abbe.Session({"machine": TABLES}), abbe.SessionError, ["instrument"]),
        (lambda: abbe.Model(3), TypeError, ["--save", "int", "session.fit().model()"]),
        (lambda: abbe.Model("missing.json"), (abbe.Error, OSError), ["missing.json"]),
    ],
)
def test_other_arguments_are_refused_with_the_call_to_use(call, kind, words):
    with pytest.raises(kind) as caught:
        call()
    for word in words:
        assert word in str(caught.value), str(caught.value)
