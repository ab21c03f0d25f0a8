"""Fits of one measurement that is written in other ways: python metamorphic.py ABBE SESSIONS COUNT [KIND].

A session of each kind of instrument is simulated with errors that are drawn at random on a machine that is drawn at
random. Its files are then changed in ways whose effect on the result is known without a fit: order, names, units, frames,
scales. The estimates agree to a share of their uncertainty, or to rounding. Prints what does not agree; exit status 1 then.
"""

import copy
import json
import math
import random
import subprocess
import sys
import tempfile
import tomllib
from pathlib import Path

ABBE, SESSIONS, COUNT = sys.argv[1], Path(sys.argv[2]), int(sys.argv[3])
ONLY = sys.argv[4:] or None

#: Largest change of an estimate in its standard uncertainties: iterations end within it.
SHARE = 5e-3
POINTS = {"workpiece_ball_mm", "spindle_ball_mm", "target_mm", "reflector_mm", "optic_mm", "ball_mm", "artefact_mm", "stylus_mm", "socket_mm", "station_mm"}
#: The plan of each kind, and the errors that are simulated and estimated; None: those of the session.
PLANS = {
    "ballbar": ("hermle-c600u/chapter5.toml", None),
    "head": ("tilting-head/session.toml", None),
    "r-test": ("r-test/plan.toml", None),
    "probe": ("self-calibration/session.toml", None),
    "laser": ("laser/plan.toml", None),
    "angle": ("angle/plan.toml", None),
    "distance": ("distance/plan.toml", None),
    "pose": ("pose/plan.toml", None),
    "tracker": (None, ["EB0J2", "EB0J3", "EB0J4", "EX0J2", "EZ0J4"]),
    "socket": (None, ["EB0J2", "EB0J3", "EX0J2", "EZ0J3"]),
    "pointing": (None, ["EA0AZ", "EB0AZ", "EA0EL"]),
}

ROBOT = """name = "arm"
chain = "w b J1 J2 J3 J4 J5 t"
[axis]
J1 = { kind = "rotary", direction = [0, 0, 1] }
J2 = { kind = "rotary", direction = [0, 1, 0], origin_mm = [75, 0, 400] }
J3 = { kind = "rotary", direction = [0, 1, 0], origin_mm = [75, 0, 1000] }
J4 = { kind = "rotary", direction = [1, 0, 0], origin_mm = [400, 0, 1100] }
J5 = { kind = "rotary", direction = [0, 1, 0], origin_mm = [700, 0, 1100] }
"""
MOUNT = """name = "mount"
chain = "w b AZ EL t"
[axis]
AZ = { kind = "rotary", direction = [0, 0, -1] }
EL = { kind = "rotary", direction = [0, -1, 0] }
"""


def value(x):
    """A value as TOML."""
    if isinstance(x, bool):
        return "true" if x else "false"
    if isinstance(x, float):
        return "inf" if math.isinf(x) else repr(x)
    if isinstance(x, dict):
        return "{ " + ", ".join(f"{json.dumps(k)} = {value(v)}" for k, v in x.items()) + " }"
    if isinstance(x, list):
        return "[" + ", ".join(value(v) for v in x) + "]"
    return json.dumps(x, ensure_ascii=False) if isinstance(x, str) else str(x)


def text(document):
    lines = [f"{k} = {value(v)}" for k, v in document.items() if k != "test"]
    for test in document.get("test", []):
        lines += ["[[test]]"] + [f"{json.dumps(k)} = {value(v)}" for k, v in test.items()]
    return "\n".join(lines) + "\n"


class Table:
    """The columns of a data file by their names, and its rows of cells."""

    def __init__(self, contents):
        lines = [line for line in contents.splitlines() if line and not line.startswith("#")]
        self.names = lines[0].split(",")
        self.rows = [line.split(",") for line in lines[1:]]

    def text(self):
        return "\n".join([",".join(self.names)] + [",".join(row) for row in self.rows]) + "\n"

    def scale(self, is_of, factor, unit=None):
        for place, name in enumerate(self.names):
            if is_of(name):
                for row in self.rows:
                    row[place] = repr(float(row[place]) * factor) if row[place] else ""
                if unit:
                    self.names[place] = name.rsplit("_", 1)[0] + "_" + unit

    def drop(self, *names):
        kept = [place for place, name in enumerate(self.names) if name not in names]
        self.names = [self.names[place] for place in kept]
        self.rows = [[row[place] for place in kept] for row in self.rows]

    def runs(self):
        """The rows of each run; one run without their column."""
        if "run" not in self.names:
            return [self.rows]
        place, runs = self.names.index("run"), []
        for row in self.rows:
            if not runs or runs[-1][-1][place] != row[place]:
                runs.append([])
            runs[-1].append(row)
        return runs


class Measured:
    """A session as a document, its machine, and its tables."""

    def __init__(self, document, machine, tables, errors):
        self.document, self.machine, self.tables, self.errors = document, machine, tables, errors

    def copy(self):
        return copy.deepcopy(self)

    def write(self, folder):
        folder.mkdir(parents=True, exist_ok=True)
        document = dict(self.document, machine=self.machine)
        (folder / "session.toml").write_text(text(document), encoding="utf-8")
        for name, table in self.tables.items():
            (folder / name).write_text(table.text(), encoding="utf-8")

    def fit(self, folder, *options):
        self.write(folder)
        out = run("fit", folder / "session.toml", "--json", "-", "--allow-implausible", *options)
        return json.loads(out)


class Refused(Exception):
    pass


def run(*arguments):
    found = subprocess.run([ABBE, *map(str, arguments)], capture_output=True, text=True, check=False)
    if found.returncode != 0:
        raise Refused(found.stderr.strip().splitlines()[0] if found.stderr.strip() else "no message")
    return found.stdout


def rounded(points):
    return [round(x, 6) for x in points]


def plan(kind, draw):
    """A document with its machine, drawn about that of the kind."""
    source, errors = PLANS[kind]
    if kind == "tracker":
        machine = tomllib.loads(ROBOT)
        at = {f"j{k}_deg": round(draw.uniform(-25, 25), 3) for k in range(1, 6)}
        def test(k):
            held = {name: q for name, q in at.items() if name != f"j{k}_deg"}
            return {"name": f"J{k}", "target_mm": [900, 30, 1050], "target_u_um": math.inf, "setup": "tracker",
                    "spindle_setup": "target", "at": held,
                    "sweep": {"axis": f"J{k}", "from_deg": -60, "to_deg": 60, "step_deg": 6, "feed_deg_min": 600, "runs": 1}}
        document = {"instrument": {"kind": "tracker", "noise_um": 20.0}, "unknowns": {"errors": errors}, "test": [test(k) for k in range(1, 6)]}
    elif kind == "socket":
        # Joint positions near those with which the ball sits in its socket, which the program finds by inverse kinematics.
        machine = tomllib.loads(ROBOT)
        test = lambda k: {"name": f"S{k}", "socket": f"S{k}", "socket_mm": [[520, 150, 480], [560, -200, 430], [480, 20, 610]][k],
                          "ball_mm": [820, 10, 1100], "ball_u_um": math.inf, "data": f"S{k}.csv"}
        document = {"instrument": {"kind": "socket", "noise_um": 20.0}, "unknowns": {"errors": errors}, "test": [test(k) for k in range(3)]}
    elif kind == "pointing":
        machine = tomllib.loads(MOUNT)
        def test(k):
            return {"name": f"T{k}", "line_of_sight": [1, 0, 0], "at": {"el_deg": 15 + 20 * k}, "setup": "S", "spindle_setup": "T",
                    "sweep": {"axis": "AZ", "from_deg": 0, "to_deg": 350, "step_deg": 25, "feed_deg_min": 60, "runs": 1}}
        document = {"instrument": {"kind": "pointing", "noise_arcsec": 1.0}, "unknowns": {"errors": errors}, "test": [test(k) for k in range(4)]}
    else:
        file = SESSIONS / source
        document = tomllib.loads(file.read_text(encoding="utf-8"))
        machine = document.pop("machine")
        if "file" in machine:
            machine = tomllib.loads((file.parent / machine["file"]).read_text(encoding="utf-8"))
        document.pop("about", None)
        for test in document["test"]:
            test.pop("data", None)
            # Fewer readings, sooner done.
            for motion in (test.get("sweep"), test.get("path")):
                for key in ("step_deg", "step_mm"):
                    if motion and key in motion and kind in ("ballbar", "head", "r-test", "probe"):
                        motion[key] = 5 * motion[key]
    for axis in machine["axis"].values():
        # A rotary axis a little beside its place.
        if "origin_mm" in axis and kind not in ("ballbar", "head", "probe"):
            axis["origin_mm"] = rounded(x + draw.uniform(-15, 15) for x in axis["origin_mm"])
        axis.setdefault("direction", {"X": [1, 0, 0], "Y": [0, 1, 0], "Z": [0, 0, 1]}.get(next((n for n, a in machine["axis"].items() if a is axis), ""), [0, 0, 1]))
        axis.setdefault("origin_mm", [0, 0, 0])
    return document, machine


def in_sockets(document, machine, draw, folder):
    run("poses", folder / "plan.toml", "--poses", 45, "--seed", draw.randrange(1, 10**6), "--out", folder / "poses.csv")
    poses = Table((folder / "poses.csv").read_text(encoding="utf-8"))
    tables = {}
    for test in document["test"]:
        table = Table(poses.text())
        table.rows = [row for row in table.rows if row[-1] == test["name"]]
        table.drop("socket")
        table.rows = [[repr(float(cell) + draw.gauss(0, 0.001)) for cell in row] for row in table.rows]
        tables[test["data"]] = table
    # A choice of poses may leave out a socket.
    document["test"] = [test for test in document["test"] if len(tables[test["data"]].rows) > 1]
    tables = {test["data"]: tables[test["data"]] for test in document["test"]}
    return Measured(document, machine, tables, document["unknowns"]["errors"])


def simulated(kind, draw, folder):
    document, machine = plan(kind, draw)
    folder.mkdir()
    (folder / "plan.toml").write_text(text(dict(document, machine=machine)), encoding="utf-8")
    if kind == "socket":
        return in_sockets(document, machine, draw, folder)
    listed = json.loads(run("plan", folder / "plan.toml", "--no-effects", "--json", "-"))
    errors = [error["id"] for error in listed["errors"] if error["id"][2] == "0"]
    given = []
    for error in errors:
        size = draw.uniform(-20, 20)
        given += ["--error", f"{error}={size:.3f}" + ("arcsec" if error[1] in "ABC" else "um")]
    run("simulate", folder / "plan.toml", "--out", folder / "run", "--seed", draw.randrange(1, 10**6), *given)
    document = tomllib.loads((folder / "run" / "session.toml").read_text(encoding="utf-8"))
    machine = document.pop("machine")
    if "file" in machine:
        machine = tomllib.loads((folder / "run" / machine["file"]).read_text(encoding="utf-8"))
    for test in document["test"]:
        test.pop("sweep", None)
        test.pop("path", None)
    tables = {test["data"]: Table((folder / "run" / test["data"]).read_text(encoding="utf-8")) for test in document["test"]}
    return Measured(document, machine, tables, [error["id"] for error in listed["errors"]])


# What is changed. Each returns the other measurement, the factor of lengths, and which estimate becomes which (with its
# sign); None where the change means nothing for the kind.

SAME = {}


def order_of_columns(m, kind, draw):
    for table in m.tables.values():
        order = list(range(len(table.names)))
        draw.shuffle(order)
        table.names = [table.names[k] for k in order]
        table.rows = [[row[k] for k in order] for row in table.rows]
    return m, 1, SAME


def order_of_tests(m, kind, draw):
    # Times of different tests may not run backwards.
    for table in m.tables.values():
        table.drop("time_s")
    m.document["test"].reverse()
    return m, 1, SAME


def order_of_runs(m, kind, draw):
    for table in m.tables.values():
        table.drop("time_s")
        runs = table.runs()
        runs.reverse()
        if "run" in table.names:
            place = table.names.index("run")
            for number, rows in enumerate(runs):
                for row in rows:
                    row[place] = str(number + 1)
        table.rows = [row for rows in runs for row in rows]
    return m, 1, SAME


def order_of_poses(m, kind, draw):
    if kind not in ("tracker", "pose", "pointing", "distance", "socket"):
        return None
    for table in m.tables.values():
        table.drop("time_s", "run")
    unordered = m.copy()
    for table in m.tables.values():
        draw.shuffle(table.rows)
    return m, 1, SAME, unordered


def names(m, kind, draw):
    for number, test in enumerate(m.document["test"]):
        test.setdefault("setup", test["name"])
        test["name"] = f"Prüfung {number} (b)"
        for key in ("setup", "spindle_setup", "bar_setup"):
            if key in test:
                test[key] = "µ " + test[key]
    m.machine["name"] = "another"
    return m, 1, SAME


LENGTHS = ("mm", "um")
LENGTHS_OF_KEYS = ("_mm", "_um")


def units(m, kind, draw):
    for table in m.tables.values():
        table.scale(lambda name: name.endswith("_mm"), 1e-3, "m")
        table.scale(lambda name: name.endswith("_um"), 1e-3, "mm")
        table.scale(lambda name: name.endswith("_deg"), math.pi / 180, "rad")
        table.scale(lambda name: name.endswith("_arcsec"), math.pi / 180 / 3600, "rad")
    return m, 1, SAME


def header(m, kind, draw):
    for test in m.document["test"]:
        table = m.tables[test["data"]]
        test["columns"] = {name: f"Spalte {k}" for k, name in enumerate(table.names)}
        table.names = [f"Spalte {k}" for k in range(len(table.names))]
    return m, 1, SAME


def extra_columns(m, kind, draw):
    for table in m.tables.values():
        if "temperature_c" not in table.names:
            table.names.insert(1, "temperature_c")
            for row in table.rows:
                row.insert(1, f"{20 + draw.random():.4f}")
    return m, 1, SAME


def rows_twice(m, kind, draw):
    if not all("run" in table.names or "time_s" in table.names for table in m.tables.values()):
        return None
    for table in m.tables.values():
        table.rows = [row for row in table.rows for _ in range(2)]
    return m, 1, SAME


def rows_that_cannot_be(m, kind, draw):
    """Comments, blank lines, a byte order mark and other line ends."""
    return m, 1, SAME, None, "comments"


def shifted(m, kind, draw):
    if kind == "pointing":
        return None
    by = [round(draw.uniform(-200, 200), 3) for _ in range(3)]
    add = lambda x, d: f"({x}) + ({d})" if isinstance(x, str) else x + d
    for axis in m.machine["axis"].values():
        axis["origin_mm"] = [add(x, d) for x, d in zip(axis["origin_mm"], by)]
    for test in m.document["test"]:
        for key in POINTS & set(test):
            # A station is where it is in R; others are in frames that coincide with R.
            if isinstance(test[key], list) and len(test[key]) == 3:
                test[key] = [add(x, d) for x, d in zip(test[key], by)]
        # Places that are not stated are at the origin.
        if kind == "laser" or kind == "distance":
            test.setdefault("optic_mm", by) if kind == "laser" else None
            test.setdefault("reflector_mm", by)
    return m, 1, SAME


def reversed_axis(m, kind, draw):
    name = draw.choice(sorted(m.machine["axis"]))
    axis = m.machine["axis"][name]
    axis["direction"] = [-x if x else 0 for x in axis["direction"]]
    for key in ("travel_deg", "travel_mm"):
        if key in axis:
            axis[key] = [-axis[key][1], -axis[key][0]]
    if kind == "pointing":
        return None
    is_of = lambda column: column.rsplit("_", 1)[0].lower() == name.lower()
    for table in m.tables.values():
        table.scale(is_of, -1.0)
    for test in m.document["test"]:
        for key in list(test.get("at", {})):
            if is_of(key):
                held = test["at"][key]
                test["at"][key] = f"-({held})" if isinstance(held, str) else -held
    for effect in m.document.get("effect", []):
        # An effect of its position is another one.
        if effect.get("driver", effect["component"][2:]) == name:
            return None
    return m, 1, SAME


def renamed_axis(m, kind, draw):
    robots = [name for name in m.machine["axis"] if len(name) > 1]
    if not robots:
        return None
    old = draw.choice(sorted(robots))
    new = "Q" + old
    m.machine["axis"] = {new if name == old else name: axis for name, axis in m.machine["axis"].items()}
    m.machine["chain"] = " ".join(new if word == old else word for word in m.machine["chain"].split())
    for table in m.tables.values():
        table.names = [new.lower() + name[len(old):] if name.rsplit("_", 1)[0].lower() == old.lower() else name for name in table.names]
    for test in m.document["test"]:
        if "at" in test:
            test["at"] = {new.lower() + k[len(old):] if k.rsplit("_", 1)[0].lower() == old.lower() else k: v for k, v in test["at"].items()}
    swap = lambda error: error[: -len(old)] + new if error[3:] == old else error
    if "unknowns" in m.document:
        m.document["unknowns"]["errors"] = [swap(error) for error in m.document["unknowns"]["errors"]]
    return m, 1, lambda error: (swap(error), 1)


def scaled(m, kind, draw):
    if m.document.get("effect"):
        return None
    k = 2.0
    def times(x):
        if isinstance(x, list):
            return [times(y) for y in x]
        return f"({x}) * {k}" if isinstance(x, str) else x * k
    def walk(node):
        for key in list(node):
            if isinstance(node[key], dict):
                walk(node[key])
            elif key.endswith(LENGTHS_OF_KEYS):
                node[key] = times(node[key])
    walk(m.machine)
    walk(m.document["instrument"])
    for test in m.document["test"]:
        walk(test)
    for table in m.tables.values():
        table.scale(lambda name: name.endswith(LENGTHS), k)
    return m, k, SAME


def two_files(m, kind, draw):
    """A test in two: what both share has a name."""
    if kind not in ("tracker", "pose", "pointing"):
        return None
    tests = []
    for test in m.document["test"]:
        rows = m.tables[test["data"]].rows
        if len(rows) < 6:
            tests.append(test)
            continue
        for part, half in (("a", rows[: len(rows) // 2]), ("b", rows[len(rows) // 2:])):
            table = copy.deepcopy(m.tables[test["data"]])
            table.rows = half
            name = part + test["data"]
            m.tables[name] = table
            tests.append(dict(test, name=test["name"] + part, data=name))
    m.document["test"] = tests
    return m, 1, SAME


def turned(m, kind, draw):
    """A quarter turn about Z: X becomes Y, and Y becomes -X."""
    if kind not in ("ballbar", "head", "distance") or m.document.get("effect"):
        return None
    quarter = lambda p: [f"-({p[1]})" if isinstance(p[1], str) else -p[1], p[0], p[2]]
    for axis in m.machine["axis"].values():
        axis["origin_mm"], axis["direction"] = quarter(axis["origin_mm"]), quarter(axis["direction"])
    for test in m.document["test"]:
        for key in POINTS & set(test):
            test[key] = quarter(test[key])
        for key in test:
            if key.endswith("_u_um") and isinstance(test[key], list) and len(test[key]) == 3:
                test[key] = [test[key][1], test[key][0], test[key][2]]
    into = {"X": ("Y", 1), "Y": ("X", -1), "Z": ("Z", 1), "A": ("B", 1), "B": ("A", -1), "C": ("C", 1)}
    becomes = lambda error: (error[0] + into[error[1]][0] + error[2:], into[error[1]][1])
    m.document["unknowns"] = {"errors": [becomes(error)[0] for error in m.errors]}
    return m, 1, becomes


def noise(m, kind, draw):
    """The noise and all that is known beforehand, twice as uncertain: the same estimates, twice as uncertain."""
    double = lambda x: [double(y) for y in x] if isinstance(x, list) else 2 * x
    for table in (m.document["instrument"], *m.document["test"]):
        for key in table:
            if key.startswith(("noise_", "resolution_")) or key.endswith(("_u_um", "_u_arcsec")):
                table[key] = double(table[key])
    return m, 1, SAME, None, "noise"


def threads(m, kind, draw):
    return m, 1, SAME, None, "threads"


CHANGES = [
    order_of_columns, order_of_tests, order_of_runs, order_of_poses, names, units, header, extra_columns, rows_twice, rows_that_cannot_be,
    shifted, turned, reversed_axis, renamed_axis, scaled, noise, two_files, threads,
]


def estimates(fit):
    """Value and uncertainty of the identifiable errors of the machine, and the χ² of the readings."""
    found = {}
    for p in fit["parameters"]:
        # The uncertainty of a phase is no more than that of any phase.
        if p["id"][0] != "E" or "[" in p["id"] or p["id"].endswith(".phase"):
            continue
        if p.get("value") is not None and p.get("u"):
            found[p["id"]] = (p["value"], p["u"], p["unit"])
    return found


def differences(first, other, factor, becomes, exactly, noise=1):
    """What of two fits does not agree."""
    a, b = estimates(first), estimates(other)
    becomes = becomes or (lambda error: (error, 1))
    for error, (x, u, unit) in a.items():
        into, sign = becomes(error) if callable(becomes) else (error, 1)
        if into not in b:
            yield f"{error} is not identifiable any more"
            continue
        y, v, _ = b[into]
        k = factor if unit in ("um", "mm") else 1
        if abs(sign * y / k - x) > (0 if exactly else SHARE * u) or abs(v / k / noise - u) > (0 if exactly else 0.02 * u):
            yield f"{error}: {x:.6g} ± {u:.3g} becomes {sign * y / k:.6g} ± {v / k:.3g} {unit}"
    if len(a) != len(b):
        yield f"{len(a)} errors become {len(b)}"


def main():
    faults, fits = [], 0
    with tempfile.TemporaryDirectory() as place:
        for kind in PLANS if ONLY is None else ONLY:
            for seed in range(COUNT):
                folder = Path(place) / f"{kind}{seed}"
                try:
                    own = simulated(kind, random.Random(f"{kind} {seed}"), folder)
                    plain = own.fit(folder / "own")
                except Refused as why:
                    faults.append(f"{kind} {seed}: the session itself: {why}")
                    continue
                fits += 1
                for change in CHANGES:
                    draw = random.Random(f"{kind} {seed} {change.__name__}")
                    found = change(own.copy(), kind, draw)
                    if found is None:
                        continue
                    other, factor, becomes, *more = found
                    where = folder / change.__name__
                    how = more[1] if len(more) > 1 else None
                    try:
                        first = more[0].fit(folder / "first") if more and more[0] else plain
                        if change is order_of_runs or change is order_of_tests:
                            timeless = own.copy()
                            for table in timeless.tables.values():
                                table.drop("time_s")
                            first = timeless.fit(folder / "first")
                        if how == "comments":
                            other.write(where)
                            for name in other.tables:
                                lines = (where / name).read_text(encoding="utf-8").splitlines()
                                lines.insert(len(lines) // 2, "# a remark, 1, 2")
                                (where / name).write_bytes(b"\xef\xbb\xbf" + "\r\n".join([*lines, "", ""]).encode())
                            second = json.loads(run("fit", where / "session.toml", "--json", "-", "--allow-implausible"))
                        else:
                            second = other.fit(where, *(["--threads", "1"] if how == "threads" else []))
                    except Refused as why:
                        faults.append(f"{kind} {seed}, {change.__name__}: refused: {why}")
                        continue
                    fits += 1
                    exactly = how in ("threads", "comments")
                    for what in differences(first, second, factor, becomes, exactly, 2 if how == "noise" else 1):
                        faults.append(f"{kind} {seed}, {change.__name__}: {what}")
    print(f"{fits} fits, {len(faults)} faults")
    print("\n".join(faults))
    sys.exit(bool(faults))


main()
