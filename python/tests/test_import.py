"""Foreign files of readings."""

import warnings

import pytest
from conftest import SESSIONS

import abbe

FOREIGN = SESSIONS.parent / "tests" / "foreign"
ROBOT = SESSIONS / "ur10" / "machine.toml"


def test_a_foreign_file_becomes_a_session(tmp_path):
    out = tmp_path / "run1"
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always")
        imported = abbe.import_readings(FOREIGN / "deutsch.csv", machine=ROBOT, out=out)
    assert [str(warning.message) for warning in told] == imported.result["warnings"]
    assert imported.path == out / "session.toml" and imported.path.exists()
    assert imported.result["instrument"] == "tracker"
    (test,) = imported.result["tests"]
    assert (test["separator"], test["decimal"], test["encoding"]) == ("semicolon", ",", "latin1")
    assert imported.session.tests == ("deutsch",) and len(imported.session.readings("deutsch")["j1_deg"]) == 60
    # The same files as those of the command.
    assert (out / "deutsch.csv").read_bytes() == (FOREIGN / "deutsch.csv").read_bytes()


def test_what_cannot_be_used_is_an_exception(tmp_path):
    with pytest.raises(abbe.SessionError, match="no column holds the position of an axis"):
        abbe.import_readings(FOREIGN / "no-names.csv", machine=ROBOT, out=tmp_path / "x")
    with pytest.raises(TypeError, match="`machine` with `out`"):
        abbe.import_readings(FOREIGN / "ros.csv", machine=ROBOT)
    with pytest.raises(abbe.SessionError, match="no instrument `theodolite`"):
        abbe.import_readings(FOREIGN / "ros.csv", machine=ROBOT, out=tmp_path / "x", kind="theodolite")
    assert not (tmp_path / "x").exists()


def test_no_file_beside_a_session_is_replaced(tmp_path):
    plan = tmp_path / "plan.toml"
    plan.write_bytes((FOREIGN / "plan-hermle.toml").read_bytes())
    other = tmp_path / "gaps-normalised.csv"
    other.write_text("readings of another day\n")
    with pytest.raises(FileExistsError, match="rename one of the two"):
        abbe.import_readings(FOREIGN / "gaps.csv", session=plan)
    assert other.read_text() == "readings of another day\n"
    assert plan.read_bytes() == (FOREIGN / "plan-hermle.toml").read_bytes()
    other.unlink()
    assert len(abbe.import_readings(FOREIGN / "gaps.csv", session=plan).session.readings("gaps")["c_deg"]) > 60
