"""Writes docs/validation/public-data.md and the figures in docs/validation/public-data: what Abbe finds in public
measurements, with the commands.

    cargo build --release
    python studies/public_data.py --data FOLDER

FOLDER has the folders of the page's table of sources. A data set that is not there is left out, and the page says so. Only
the standard library is needed. `--abbe FILE` is the command (default: target/release/abbe, then target/checked/abbe),
`--out FILE` another page.
"""

import argparse
import json
import math
import os
import re
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from tpoint import linear_fit, linear_residuals, effect_columns, mod_file, region, rises, sky_of, stars

ROOT = Path(__file__).resolve().parents[1]
OWN = ROOT / "studies" / "public-data"
SESSIONS = ROOT / "sessions"
PAGE = ROOT / "docs" / "validation" / "public-data.md"
# The terms of the set-up of a mount: IA, IE, AW, AN. CA is the line of sight, which every session estimates.
SET_UP = ["EC0AZ", "EB0EL", "EA0AZ", "EB0AZ"]
# The nine panels of a mount on two axes.
PANELS = [f"sky-{channel}-over-{over}" for channel in ("across", "up") for over in ("azimuth", "elevation", "order")]
PANELS += ["sky-map", "sky-scatter", "sky-distribution"]
AUXTEL = "AT_point_data_20220406_tw004_corr.dat"


class Runs:
    """Runs the command, and keeps what it ran and how long it took."""

    def __init__(self, command, folder, figures):
        self.command, self.folder, self.figures, self.total_s = command, folder, figures, 0.0

    def abbe(self, *arguments, plots=False):
        """The JSON document of a command, with the seconds that it took; with `plots`, its figures for `drawn`."""
        file = self.folder / "result.json"
        file.unlink(missing_ok=True)
        call = [str(self.command), *map(str, arguments), "--json", str(file), "--quiet"]
        if plots:
            shutil.rmtree(self.folder / "plots", ignore_errors=True)
            call += ["--plots", "plots"]
        start = time.monotonic()
        done = subprocess.run(call, cwd=self.folder, capture_output=True, text=True)
        taken = time.monotonic() - start
        self.total_s += taken
        if done.returncode != 0 or not file.exists():
            raise SystemExit(f"{' '.join(call)}\n{done.stderr}")
        return json.loads(file.read_text(encoding="utf-8")), taken

    def drawn(self, data_set, names):
        """Keeps figures of the last command with plots beside the page, and shows them."""
        self.figures.mkdir(parents=True, exist_ok=True)
        for old in self.figures.glob(f"{data_set}-*.svg"):
            old.unlink()
        shown = []
        for name in names:
            drawing = (self.folder / "plots" / f"{name}.svg").read_text(encoding="utf-8")
            (self.figures / f"{data_set}-{name}.svg").write_text(drawing + "\n", encoding="utf-8")
            title = " ".join(re.findall(r'class="title"[^>]*>([^<]*)<', drawing))
            shown.append(f"![{title}]({self.figures.name}/{data_set}-{name}.svg)")
        return "\n".join(shown) + "\n"

    def session(self, name, text, folder):
        """A session file beside a machine file."""
        if (folder / "machine.toml").exists():
            shutil.copy(folder / "machine.toml", self.folder / "machine.toml")
        (self.folder / name).write_text(text, encoding="utf-8")
        return name


def figure(value, digits=2):
    return "–" if value is None else f"{value:.{digits}f}"


def rms(of, key):
    """A figure of readings: µm or arcsec."""
    return next((of[f"{key}_{unit}"] for unit in ("um", "arcsec") if of.get(f"{key}_{unit}") is not None), None)


def on_the_sky(value):
    """Sky rms from the rms of the two coordinates of a star."""
    return None if value is None else value * math.sqrt(2)


def table(columns, rows):
    line = lambda cells: "| " + " | ".join(str(cell).replace("|", "\\|") for cell in cells) + " |"
    return "\n".join([line(columns), "|" + "---|" * len(columns), *map(line, rows)])


def value_and_u(parameter):
    digits = max(0, 1 - math.floor(math.log10(parameter["u"]))) if parameter.get("u") else 2
    unit = {"um": " µm", "arcsec": "″", "deg": "°", "arcsec/m": "″/m", "um/m": " µm/m"}.get(parameter["unit"], f" {parameter['unit']}")
    return f"{parameter['value']:.{digits}f} ± {parameter['u']:.{digits}f}{unit}"


def in_words(effects):
    """The effects of a trace in words, with their values."""
    if not effects:
        return "none"
    words = []
    for effect in effects:
        shown = effect["parameters"][:2] if len(effect["parameters"]) <= 2 else []
        values = ", ".join(value_and_u(parameter) for parameter in shown)
        words.append(effect["meaning"] + (f", {values}" if values else ""))
    return "; ".join(words)


# Telescopes


def searched_without(runs, session, data, lines, most):
    """Sky rms over left-out regions if the search, too, does not see the region: the effects and the values that stars
    elsewhere give, in the linear design, on the stars of the region. `data` are the stars, `lines` their lines in the file."""
    source = (runs.folder / session).read_text(encoding="utf-8")
    head, *rest = lines
    squares = 0.0
    for left in sorted({region(star) for star in data}):
        others = [(star, line) for star, line in zip(data, rest) if region(star) != left]
        (runs.folder / "others.dat").write_text("\n".join([head, *(line for _, line in others)]) + "\n", encoding="utf-8")
        runs.session("others.toml", re.sub(r'data = ".*"', 'data = "others.dat"', source), SESSIONS / "telescope")
        limit = ["--max-effects", most] if most else []
        trace, _ = runs.abbe("trace", "others.toml", *limit)
        dropped = {outlier["line"] - 5 for outlier in trace["outliers"]}
        fitted = [star for number, (star, _) in enumerate(others) if number not in dropped]
        inside = [star for star in data if region(star) == left]
        names = ["IA", "IE", "AN", "AW", "CA"]
        squares += sum(value * value for value in linear_residuals(fitted, inside, names, trace["effects"]))
    return math.sqrt(squares / len(data))


def set_up_alone(name, text):
    """The session with the five terms of the set-up."""
    text = re.sub(r"\n(# [^\n]*\n)?\[\[effect\]\]\n(?:\w[^\n]*\n)+", "\n", text)
    return re.sub(r"errors = \[.*?\]", "errors = " + json.dumps(SET_UP), text)


def sky_figures(of):
    return [figure(on_the_sky(rms(of, key))) for key in ("rms", "interpolation_rms", "extrapolation_rms")]


def telescopes(runs, data):
    source = SESSIONS / "telescope"
    auxtel, mmt = data / "telescopes" / "auxtel", data / "telescopes" / "mmt"
    if not (auxtel / AUXTEL).exists() or not mmt.exists():
        return None
    lines = []
    own = {name: (source / f"{name}.toml").read_text(encoding="utf-8") for name in ("auxtel", "mmt")}
    six = runs.session("auxtel-six.toml", own["auxtel"], source)
    five = runs.session("auxtel-five.toml", set_up_alone("auxtel", own["auxtel"]), source)
    rows = []
    for name, session in (("set-up: IA, IE, AN, AW, CA", five), ("six terms, with TX", six)):
        fit, taken = runs.abbe("fit", session, "--data", auxtel)
        rows.append([name, fit["parameter_count"], fit["readings"], *sky_figures(fit), f"{taken:.1f} s"])
    traced = {}
    for most in (3, None):
        limit = ["--max-effects", most] if most else []
        trace, taken = runs.abbe("trace", five, "--data", auxtel, *limit, plots=True)
        name = "`trace`" + (f", at most {most} effects" if most else ", until nothing more lowers the held-out error")
        if not traced:
            before = trace["before"]
            rows.append(["set-up, without the outlier", before["parameter_count"], trace["readings"], *sky_figures(before), ""])
        rows.append([name, trace["after"]["parameter_count"], trace["readings"], *sky_figures(trace["after"]), f"{taken:.1f} s"])
        traced[most] = trace
    trace = traced[None]
    panels = runs.drawn("auxtel", PANELS)
    columns = ["model", "parameters", "stars", "in sample, ″", "interpolation, ″", "left-out regions, ″", "time"]
    found = stars(auxtel / AUXTEL)
    outliers = [outlier["line"] for outlier in trace["outliers"]]
    kept = stars(auxtel / AUXTEL, outliers)
    text = (auxtel / AUXTEL).read_text(encoding="utf-8").splitlines()
    usable = lambda line: len(line.split(";")[0].split()) >= 4
    numbered = [(number, line) for number, line in enumerate(text, 1) if number > 4 and usable(line)]
    nested = []
    for most in (3, None):
        cells = []
        for chosen, without in ((found, ()), (kept, outliers)):
            lines_of = ["\n".join(text[:4]), *(line for number, line in numbered if number not in without)]
            cells.append(figure(searched_without(runs, five, chosen, lines_of, most)))
        nested.append(["`trace`" + (f", at most {most} effects" if most else ""), *cells])
    n_six, sky_six, terms_six = mod_file(auxtel / "at_20220406_ia_ie_an_aw_tx10_ca.mod")
    n_auto, sky_auto, terms_auto = mod_file(auxtel / "at_20220406_fauto.mod")
    lines += [
        "## AuxTel, April 2022\n",
        f"{len(found)} stars of the LSST auxiliary telescope. Sky rms, of both coordinates together. TPOINT printed"
        f" {sky_six:.2f}″ for six terms on {n_six} stars and {sky_auto:.2f}″ for {len(terms_auto)} automatic terms on {n_auto} stars.\n",
        table(columns, rows),
        f"\n`trace` adds: {in_words(trace['effects'])}. Beside the first two effects it excludes {len(outliers)} star as an"
        f" outlier, in line {', '.join(map(str, outliers)) or 'none'} of the file. The stars before (set-up) and after (with"
        " these effects):\n",
        panels,
    ]
    names = [name for name, *_ in terms_auto]
    whole = linear_fit(found, names)
    five_terms = ["IA", "IE", "AN", "AW", "CA"]
    compared = [
        ("set-up", five_terms, []),
        ("six terms", [name for name, *_ in terms_six], []),
        ("set-up and the effects of `trace`, at most 3", five_terms, traced[3]["effects"]),
        ("set-up and the effects of `trace`", five_terms, trace["effects"]),
        ("automatic terms of TPOINT", names, []),
    ]
    comparison = []
    for label, terms, effects in compared:
        count = len(terms) + sum(len(effect_columns(effect)) for effect in effects)
        cells = [cell for chosen in (found, kept) for cell in sky_of(chosen, linear_fit(chosen, terms, effects))]
        comparison.append([label, count, *cells])
    lines += [
        "An independent linear least squares (in `studies/public_data.py`) of the terms of TPOINT and of these effects, over twelve regions of 60° of"
        " azimuth, below and above 45°, on all stars and without the outlier:\n",
        table(
            ["terms", "number", "all: in sample, ″", "all: left-out regions, ″", "without outlier: in sample, ″", "without outlier: left-out regions, ″"],
            comparison,
        ),
        "\nThe effects of `trace` in this table are chosen with all stars, and their values are fitted without the region. If the"
        " search, too, does not see the region, the sky rms over left-out regions is:\n",
        table(["search without the region", "all stars, ″", "without the outlier, ″"], nested),
        "\nWhich automatic terms hold out of sample? Each one is left out in turn; & marks those that TPOINT added by itself. A term holds if the sum of squares over"
        " left-out regions rises without it by more than the standard error of the rise, from the scatter of the regions.\n",
    ]
    whole_kept = linear_fit(kept, names)
    judged = []
    holding, failing, uncertain = [], [], []
    for name, value, sigma, automatic in terms_auto:
        if name in ("IA", "AN", "AW", "CA"):
            continue
        others = [other for other in names if other != name]
        cells, holds = [], []
        for chosen, of_all in ((found, whole), (kept, whole_kept)):
            without = linear_fit(chosen, others)
            holds.append(rises(without[1], of_all[1]))
            cells += [sky_of(chosen, without)[1], "holds" if holds[-1] else "does not hold"]
        (holding if all(holds) else uncertain if any(holds) else failing).append(name)
        judged.append([f"& {name}" if automatic else name, f"{value:.2f} ± {sigma:.2f}", *cells])
    lines += [
        table(["term", "TPOINT, ″", "all stars, regions without it, ″", "all stars", "without outlier, regions without it, ″", "without outlier"], judged),
        f"\nHold on both sets of stars: {', '.join(holding) or 'none'}. Hold on one set only: {', '.join(uncertain) or 'none'}. Hold on neither:"
        f" {', '.join(failing) or 'none'}. All {len(names)} terms leave {sky_of(found, whole)[1]}″ over left-out regions on all stars and"
        f" {sky_of(kept, whole_kept)[1]}″ without the outlier, where TPOINT printed {sky_auto:.2f}″ in sample for {n_auto} stars.\n",
    ]
    lines += ["## Models of one night on another\n", *nights(runs, source, own, auxtel, mmt)]
    return "\n".join(lines)


def nights(runs, source, own, auxtel, mmt):
    anew = ",".join(SET_UP)
    rows = []

    def validated(machine, folder, text, model_night, model_file, night, file):
        session = runs.session("model.toml", re.sub(r'data = ".*"', f'data = "{model_file}"', text), source)
        runs.abbe("fit", session, "--data", folder, "--save", "night.json")
        other = runs.session("night.toml", re.sub(r'data = ".*"', f'data = "{file}"', text), source)
        found, taken = runs.abbe("validate", "night.json", other, "--data", folder, "--anew", anew)
        set_up = runs.session("alone.toml", set_up_alone("", (runs.folder / "night.toml").read_text(encoding="utf-8")), source)
        alone, _ = runs.abbe("fit", set_up, "--data", folder)
        moved = "; ".join(f"{one['id']} {value_and_u(one)}" for one in found["moved"]) or "none"
        figures = [figure(on_the_sky(rms(of, "rms"))) for of in (found["model"], alone)]
        rows.append([machine, model_night, night, found["readings"], *figures, f"`{found['verdict']}`", moved])

    six = own["auxtel"]
    validated("AuxTel, TX", auxtel, six, "2022-04", AUXTEL, "2020-01", "AT_point_file_20200125.dat")
    validated("AuxTel, TX", auxtel, six, "2022-04", AUXTEL, "2020-02", "AT_point_file_20200219T031756.dat")
    validated("AuxTel, TX", auxtel, six, "2020-01", "AT_point_file_20200125.dat", "2022-04", AUXTEL)
    validated("MMT, NPAE, TF, TX", mmt, own["mmt"], "2021-08", "point_20210821.dat", "2023-07", "point_20230702.dat")
    validated("MMT, NPAE, TF, TX", mmt, own["mmt"], "2023-07", "point_20230702.dat", "2021-08", "point_20210821.dat")
    columns = ["machine, terms", "model of", "stars of", "stars", "model, set-up anew, ″", "set-up alone, ″", "verdict", "moved"]
    text = "The set-up (IA, IE, AN, AW, CA) is estimated anew; the other terms are those of the model. Sky rms.\n"
    searched, panels = [], ""
    for night, file in (("2021-08", "point_20210821.dat"), ("2023-07", "point_20230702.dat")):
        session = runs.session("mmt-five.toml", set_up_alone("mmt", own["mmt"]).replace("point_20210821.dat", file), source)
        trace, taken = runs.abbe("trace", session, "--data", mmt, plots=True)
        if trace["effects"]:
            panels += f"\nThe stars of {night} before and after:\n\n" + runs.drawn(f"mmt-{night}", PANELS)
        for name, of in (("set-up", trace["before"]), ("`trace`", trace["after"])):
            effects = in_words(trace["effects"]) if of is trace["after"] else ""
            searched.append([night, name, of["parameter_count"], *sky_figures(of), effects])
    return [
        text,
        table(columns, rows),
        "\n## MMT, `trace` from the set-up\n",
        table(["night", "model", "parameters", "in sample, ″", "interpolation, ″", "left-out regions, ″", "effects"], searched) + "\n" + panels,
    ]


# Linear axis


def linear_axis(runs, data):
    file = data / "linear_axis_ess" / "b02_x_ISO230.dat"
    if not file.exists():
        return None
    text = file.read_text(encoding="utf-8")
    target = {int(i): float(v) for i, v in re.findall(r"^TGT_DATA\[(\d+)\]=(\S+)", text, re.MULTILINE)}
    read = lambda word: {
        (int(i), int(k)): float(v) for i, k, v in re.findall(rf"^REF_DATA_{word}\[(\d+),(\d+)\]=(\S+)", text, re.MULTILINE)
    }
    forward, backward = read("FWD"), read("BWD")
    places, cycles = sorted(target), sorted({k for _, k in forward})

    def write(name, chosen):
        lines = ["run,x_mm,displacement_mm"]
        for cycle in chosen:
            lines += [f"{2 * cycle - 1},{target[i]},{forward[i, cycle]:.7f}" for i in places]
            lines += [f"{2 * cycle},{target[i]},{backward[i, cycle]:.7f}" for i in reversed(places)]
        (runs.folder / f"{name}.csv").write_text("\n".join(lines) + "\n", encoding="utf-8")
        session = (OWN / "linear-axis.toml").read_text(encoding="utf-8").replace("linear-axis.csv", f"{name}.csv")
        return runs.session(f"{name}.toml", session, OWN)

    whole = write("linear-axis", cycles)
    fit, _ = runs.abbe("fit", whole)
    trace, taken = runs.abbe("trace", whole, plots=True)
    drawn = runs.drawn("linear-axis", ["residual-X-over-X"])
    # Every cycle is predicted by the model that a trace of the others finds.
    squares, nominal, names, readings = 0.0, 0.0, [], 0
    for left in cycles:
        others, one = write("others", [cycle for cycle in cycles if cycle != left]), write("cycle", [left])
        found, _ = runs.abbe("trace", others, "--save", "others.json")
        judged, _ = runs.abbe("validate", "others.json", one)
        squares += judged["model"]["rms_um"] ** 2 * judged["readings"]
        nominal += judged["nominal"]["rms_um"] ** 2 * judged["readings"]
        readings += judged["readings"]
        names.append(", ".join(sorted({effect["shape"] for effect in found["effects"]})))
    before, after = trace["before"], trace["after"]
    rows = [
        ["zero of the sensor alone", before["parameter_count"], figure(rms(before, "rms")), figure(rms(before, "heldout_rms")), figure(math.sqrt(nominal / readings))],
        ["`trace`", after["parameter_count"], figure(rms(after, "rms")), figure(rms(after, "heldout_rms")), figure(math.sqrt(squares / readings))],
    ]
    iso = {one["id"]: one["value"] for one in fit["positioning"][0]["figures"]}
    published = f"The source prints M = 93.65 µm and A = 135.27 µm by ISO 230-2; `fit` gives M = {figure(iso['mean_range'])} µm and A = {figure(iso['accuracy'])} µm."
    remains = trace["remainder"]
    return "\n".join([
        "## Linear axis, ISO 230-2\n",
        f"{fit['readings']} readings of {len(places)} targets in {len(cycles)} cycles and both directions. {published}\n",
        table(["model", "parameters", "in sample, µm", "left-out runs, µm", "left-out cycles, search repeated and zero anew, µm"], rows),
        f"\n`trace` finds: {in_words(trace['effects'])}. Without each cycle it finds {'; '.join(sorted(set(names)))}."
        f" Verdict `{trace['verdict']}`: " + (f"{remains['where']} remains (p ≤ {remains['p_value']:.3f})." if remains["structured"] else "no structure remains.") + f" {taken:.1f} s.\n",
        drawn,
    ])


# Robots


def robots(runs, data):
    parts = []
    ur10, kuka = data / "landgraf_ur10", data / "mukca"
    columns = ["model", "in sample, mm", "interpolation, mm", "left-out blocks of joint space, mm", "next session, mm", "time"]
    length = lambda of, key: figure(of[f"{key}_um"] * 1e-3, 3) if of.get(f"{key}_um") is not None else "–"
    figures = lambda of: [length(of, key) for key in ("rms_3d", "interpolation_rms_3d", "extrapolation_rms_3d")]
    before_and_after = "\n\nRms length of the residual before (location errors) and after (with these effects):\n\n"
    if ur10.exists():
        text = (SESSIONS / "ur10" / "session.toml").read_text(encoding="utf-8")
        session = runs.session("ur10.toml", text, SESSIONS / "ur10")
        second = re.sub(r"Series_A.measurements_grid", "Series_B/measurements_joint_configurations", text)
        series_b = runs.session("ur10-b.toml", second, SESSIONS / "ur10")
        fit, fit_s = runs.abbe("fit", session, "--data", data, "--save", "ur10-fit.json")
        trace, trace_s = runs.abbe("trace", session, "--data", data, "--save", "ur10.json", plots=True)
        judged, _ = runs.abbe("validate", "ur10.json", series_b, "--data", data)
        rows = [
            ["location errors", *figures(fit), length(judged["locations"], "rms_3d"), f"{fit_s:.1f} s"],
            ["`trace`", *figures(trace["after"]), length(judged["model"], "rms_3d"), f"{trace_s:.0f} s"],
        ]
        parts.append(
            f"## UR10 before a laser tracker\n\n{fit['readings']} poses of Series A; the next session is Series B, {judged['readings']} poses,"
            f" nominal {length(judged['nominal'], 'rms_3d')} mm, verdict `{judged['verdict']}`. Rms of the 3-vector.\n\n"
            + table(columns, rows) + f"\n\n`trace` finds: {in_words(trace['effects'])}." + before_and_after
            + runs.drawn("ur10", ["residual-over-X-Y", "residual-over-X-Z"])
        )
    if kuka.exists():
        session = runs.session("kuka.toml", (SESSIONS / "kuka-iiwa14" / "session.toml").read_text(encoding="utf-8"), SESSIONS / "kuka-iiwa14")
        fit, fit_s = runs.abbe("fit", session, "--data", data)
        trace, trace_s = runs.abbe("trace", session, "--data", data, plots=True)
        over_joints = sorted(file.stem for file in (runs.folder / "plots").glob("residual-over-J*.svg"))
        rows = [
            ["location errors", *figures(fit), "–", f"{fit_s:.1f} s"],
            ["`trace`", *figures(trace["after"]), "–", f"{trace_s:.1f} s"],
        ]
        parts.append(
            f"## KUKA iiwa 14 in sockets\n\n{fit['readings']} poses, rms of the 3-vector.\n\n" + table(columns, rows)
            + f"\n\n`trace` finds: {in_words(trace['effects'])}." + before_and_after + runs.drawn("kuka", over_joints)
        )
    parts += positioner(runs, data)
    return "\n".join(parts) or None


def positioner(runs, data):
    """A positioner of two axes before a camera: the section, or nothing where its file is not there."""
    file = data / "industrial_calibration" / "measurements.yaml"
    if not file.exists():
        return []
    rows = ["j1_deg,j2_deg,px_mm,py_mm,pz_mm,qx,qy,qz,qw"]
    for entry in re.split(r"^'[0-9]+':", file.read_text(encoding="utf-8"), flags=re.M)[1:]:
        pose = {key: float(value) for key, value in re.findall(r"^    (q[wxyz]|[xyz]): (\S+)", entry, re.M)}
        joints = [math.degrees(float(joint)) for joint in re.findall(r"^  - (\S+)", entry, re.M)]
        rows.append(",".join(map(repr, joints + [1e3 * pose[key] for key in "xyz"] + [pose[key] for key in ("qx", "qy", "qz", "qw")])))
    (runs.folder / "positioner.csv").write_text("\n".join(rows) + "\n", encoding="utf-8")
    # Where the target stands on the table is not known: it is found before the fit.
    for name in ("machine", "session"):
        shutil.copy(OWN / "positioner" / f"{name}.toml", runs.folder / f"positioner-{name}.toml")
    fit, taken = runs.abbe("fit", "positioner-session.toml")
    errors = {error["id"]: error for error in fit["parameters"]}
    quoted = [[f"`{id}`", value_and_u(errors[id])] for id in ("EX0J2", "EA0J2")]
    return [
        f"## Two-axis positioner before a camera\n\n{fit['readings']} poses of a target whose place on the table no one stated, rank {fit['rank']} of"
        f" {fit['parameter_count']}, {taken:.1f} s. The offset and the angle of the second axis against the first:\n\n" + table(["error", "value"], quoted) + "\n"
    ]


SOURCES = [
    ["`telescopes/auxtel`", "LSST auxiliary telescope, stars and fits of TPOINT", "[ts_analysis_notebooks](https://github.com/lsst-ts/ts_analysis_notebooks), `notebooks/auxtel/atptg/pointing_model/data`", "GPL-3"],
    ["`telescopes/mmt`", "MMT, stars of two nights", "[pytelpoint](https://github.com/MMTObservatory/pytelpoint)", "BSD-3"],
    ["`linear_axis_ess`", "linear axis, ISO 230-2", "[ecmc_target_muts_logger](https://github.com/anderssandstrom/ecmc_target_muts_logger), `b02/x`", "none stated"],
    ["`landgraf_ur10`", "UR10 before a laser tracker", "[ipa-robot-accuracy](https://github.com/christianlandgraf/ipa-robot-accuracy), Landgraf et al., CASE 2021", "MIT"],
    ["`mukca/kuka_14`", "KUKA iiwa 14, ball in sockets", "[kinematics_calibration](https://github.com/platonics-delft/kinematics_calibration)", "MIT"],
    ["`industrial_calibration`", "two-axis positioner before a camera, 205 poses", "[industrial_calibration](https://github.com/ros-industrial/industrial_calibration), `examples/data/kinematic_calibration/measurements.yaml`", "Apache-2.0"],
]


def page(parts, missing, total_s):
    head = [
        "# Public measurements",
        "",
        "*Generated by `python studies/public_data.py --data FOLDER`; nothing on this page is written by hand.*",
        "",
        "After this page you can judge Abbe on measurements that anyone can fetch, and repeat every figure:",
        "",
        "```console",
        "cargo build --release",
        "python studies/public_data.py --data FOLDER",
        "```",
        "",
        f"The commands of this page took {total_s:.0f} s together. *In sample* is the residual of the fitted readings. *Interpolation* leaves"
        " out random poses, *left-out regions* and *blocks* whole parts of the sky or of the joint space; a trace of many"
        " readings repeats its search without each one, and a trace of few poses fits the values of its effects without it. [Robots](../guide/robots.md) and [pointing](../guide/pointing.md) explain the sessions.",
        "",
        table(["folder", "data", "source", "licence"], SOURCES),
        "",
    ]
    if missing:
        head += [f"Not run, because the folder has no data: {', '.join(missing)}.", ""]
    return "\n".join(head) + "\n" + "\n".join(parts).rstrip() + "\n"


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--data", type=Path, required=True, help="the folder of the data sets")
    parser.add_argument("--abbe", type=Path, help="the command; default target/release/abbe, then target/checked/abbe")
    parser.add_argument("--out", type=Path, default=PAGE, help="the page to write")
    options = parser.parse_args()
    target = Path(os.environ.get("CARGO_TARGET_DIR", ROOT / "target"))
    command = options.abbe or next((file for profile in ("release", "checked") if (file := target / profile / "abbe").exists()), None)
    if command is None:
        parser.error("no command is built: run `cargo build --release`, or state it by --abbe")
    data = options.data.resolve()
    if not data.is_dir():
        parser.error(f"{data} is no folder")
    with tempfile.TemporaryDirectory() as folder:
        runs = Runs(command.resolve(), Path(folder), options.out.parent / options.out.stem)
        parts, missing = [], []
        for name, of in (("telescopes", telescopes), ("linear axis", linear_axis), ("robots", robots)):
            part = of(runs, data)
            parts.append(part) if part else missing.append(name)
        options.out.parent.mkdir(parents=True, exist_ok=True)
        options.out.write_text(page(parts, missing, runs.total_s), encoding="utf-8")
    print(f"{options.out}: {runs.total_s:.0f} s")
    return 0


if __name__ == "__main__":
    sys.exit(main())
