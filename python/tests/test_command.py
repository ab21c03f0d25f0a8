"""Every result is that of the command, to the last printed digit."""

import csv
import io
import pickle
import re
import subprocess

import numpy as np
import pytest
from conftest import MEASURED, PLANS, SESSIONS, find_command

import abbe


def test_versions_agree(command):
    assert command("--version", json=False).split() == ["abbe", abbe.__version__]


@pytest.mark.parametrize("name", MEASURED)
def test_fit(command, name):
    fit = abbe.Session.read(SESSIONS / name).fit()
    assert fit._handle.json() == command("fit", SESSIONS / name)
    for parameter in fit.to_dict()["parameters"]:
        assert fit[parameter["id"]].to_dict() == parameter
    assert np.sqrt(np.diag(fit.covariance)) == pytest.approx([p.u for p in fit.parameters], rel=1e-12)


@pytest.mark.parametrize("name", PLANS)
def test_plan(command, name):
    session = abbe.Session.read(SESSIONS / name)
    plan = session.plan(effects=False)
    assert plan._handle.json() == command("plan", SESSIONS / name, "--no-effects")
    assert list(plan.ids) == [error["id"] for error in plan.to_dict()["errors"]]
    largest = np.max([np.abs(plan.sensitivity(test)).max(axis=0) for test in session.tests], axis=0)
    if session.instrument == "ballbar":
        assert largest == pytest.approx([abs(error.sensitivity.largest) for error in plan.errors], rel=1e-12)


def test_plan_with_options(command):
    session = abbe.Session.read(SESSIONS / PLANS[1])
    plan = session.plan(noise_um=0.5)
    assert plan._handle.json() == command("plan", SESSIONS / PLANS[1], "--noise-um", 0.5)


def test_trace_model_validation_and_report(command, measured, tmp_path):
    file = SESSIONS / MEASURED[0]
    said = []
    trace = measured.trace(progress=said.append, only=["EZC", "EAC"])
    model = tmp_path / "model.json"
    text = command("trace", file, "--only", "EZC", "--only", "EAC", "--save", model)
    assert trace._handle.json() == re.sub(r'\n *"save": ".*",', "", text)
    assert trace.verdict == "explained" and trace.effects[0].component == "EZC"
    assert trace["EZC~C:h2.amplitude"].value == trace.effects[0].parameters[0].value
    assert said[0] == "fitting the declared model" and any("EZC~C:h2" in words for words in said)

    own = trace.model()
    own.save(tmp_path / "own.json")
    read = abbe.Model.read(model)
    assert own.to_dict()["parameters"] == read.to_dict()["parameters"]
    assert own.to_dict()["covariance"] == read.to_dict()["covariance"]

    fresh = abbe.Session.read(SESSIONS / PLANS[1]).simulate({"EY0A": 35.0}, seed=5)
    folder = fresh.save(tmp_path / "fresh")
    fresh = abbe.Session.read(folder)
    validation = read.validate(fresh)
    assert validation._handle.json() == command("validate", model, folder)

    trace.report(tmp_path / "trace.html")
    page = (tmp_path / "trace.html").read_text()
    assert page.startswith("<!DOCTYPE html>") and "abbe.Session.trace" in page
    assert trace.residuals["C150"].std() < trace.residuals_before["C150"].std()


def test_residual_table(command, measured, tmp_path):
    fit = measured.fit()
    file = tmp_path / "residuals.csv"
    command("fit", SESSIONS / MEASURED[0], "--residuals", file)
    assert fit.residual_table().to_csv() == file.read_text()
    rows = [row for row in csv.DictReader(io.StringIO(file.read_text())) if row["test"] == "C150"]
    assert fit.residuals["C150"] == pytest.approx([float(row["residual_um"]) for row in rows], abs=6e-5)
    outliers = [row["counts"] != "yes" for row in rows]
    assert fit.is_outlier["C150"].sum() == sum(outliers)


def test_simulation(command, chapter5, tmp_path):
    values = {"EX0C": 10.0, "EB0A": -1.3, "bar[A150]": "0.4um"}
    session = chapter5.simulate(values, seed=7)
    command(
        "simulate", SESSIONS / PLANS[1], "--out", tmp_path / "run", "--seed", 7,
        *("--error", "EX0C=10um", "--error", "EB0A=-1.3arcsec", "--error", "bar[A150]=0.4um"),
    )
    other = abbe.Session.read(tmp_path / "run" / "session.toml")
    for test in session.tests:
        for name, column in session.readings(test).items():
            # Files have times to 1e-12 s.
            assert column == pytest.approx(other.readings(test)[name], rel=1e-14, abs=1e-12), (test, name)
    assert session.fit()["EX0C"].value == pytest.approx(other.fit()["EX0C"].value, rel=1e-9)
    # A hidden effect stands in the readings, and not in the session.
    truth = abbe.Session.read(SESSIONS / PLANS[1])
    truth.add_effect(component="EZC", driver="C", shape="harmonic", order=2)
    hidden = truth.simulate({**values, "EZC~C:h2.cos": 2.0}, seed=7, hide_effects=True)
    assert hidden.effects == () and "[[effect]]" not in hidden.to_toml()
    c = np.radians(hidden.readings("C150")["c_deg"])
    difference = hidden.readings("C150")["reading_mm"] - session.readings("C150")["reading_mm"]
    assert np.corrcoef(difference, np.cos(2 * c))[0, 1] ** 2 > 0.9


def test_compensation(command, measured, tmp_path):
    model = measured.fit().model()
    model.save(tmp_path / "model.json")
    random = np.random.default_rng(1)
    commands = {
        "x_mm": random.uniform(-100, 100, 50),
        "c_deg": random.uniform(-180, 180, 50),
        "a_deg": random.uniform(-20, 60, 50),
    }
    rows = np.stack(list(commands.values()), axis=1)
    np.savetxt(tmp_path / "in.csv", rows, delimiter=",", header=",".join(commands), comments="", fmt="%.17g")
    command("compensate", tmp_path / "model.json", tmp_path / "in.csv", "--out", tmp_path / "out.csv")
    command("compensate", tmp_path / "model.json", tmp_path / "in.csv", "--out", tmp_path / "err.csv", "--inverse")
    out = list(csv.DictReader((tmp_path / "out.csv").open()))
    found = model.compensate(commands)
    assert list(found.states) == [row["state"] for row in out]
    for place, axis in enumerate(model.machine.axes):
        unit = "deg" if axis in "AC" else "mm"
        stated = [f"{value:.10f}" for value in found.positions[:, place]]
        assert stated == [row[f"{axis.lower()}_{unit}"] for row in out]
    errors = list(csv.DictReader((tmp_path / "err.csv").open()))
    names = ["dx_um", "dy_um", "dz_um", "da_arcsec", "db_arcsec", "dc_arcsec"]
    own = model.pose_errors(commands)
    assert [[f"{value:.6f}" for value in row] for row in own] == [[row[name] for name in names] for row in errors]


@pytest.mark.parametrize("language", ["text", "latex", "python"])
def test_equation(command, chapter5, language):
    options = ["--test", "C150", "--order", "first", "--as", language]
    # The module calls Python with arrays.
    options += ["--layout", "flat"] if language == "python" else []
    printed = command("equation", SESSIONS / PLANS[1], *options, json=False)
    assert chapter5.equation("C150", order="first").print(language).rstrip() == printed.rstrip()


def test_messages_are_those_of_the_command(command, tmp_path):
    folder = tmp_path / "bad"
    subprocess.run([find_command(), "new", folder, "--template", "hermle-c600u"], check=True, capture_output=True)
    file = folder / "chapter5.toml"
    file.write_text(file.read_text().replace('bar_mm = "R_e"', "bar_mm = -3", 1))
    said = command("plan", file, error=True, json=False)
    with pytest.raises(abbe.SessionError) as caught:
        abbe.Session.read(file)
    error = caught.value
    assert error.message in said
    assert error.file == str(file)
    line = file.read_text().splitlines()[error.line - 1]
    assert line.startswith("bar_mm = -3") and line[error.column - 1 :] == "-3"


def test_an_analysis_by_its_name(chapter5):
    found = abbe.analyse("plan", chapter5, no_effects=True)
    assert found.to_dict() == chapter5.plan(effects=False).to_dict()
    assert pickle.loads(pickle.dumps(found)) == found
    with pytest.raises(abbe.SessionError, match="an option of `plan` cannot be used"):
        abbe.analyse("plan", chapter5, effects=False)
