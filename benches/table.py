"""Measures what Abbe costs in one run, and writes two tables: the costs with their targets into the record of figures,
docs/development/figures.toml, and the benchmarks into docs/development/speed.md, between `<!-- speeds -->` and `<!-- /speeds -->`.

    python benches/table.py                      every stage, one after the other, on otherwise idle processors
    python benches/table.py build commands       these stages only; the other rows keep their figures
    python benches/table.py kernel --native      also benchmarks of a build for the present processor, in target/native
    python benches/table.py --read               no run: the last figures

Stages: build (cold release build, rebuild of the developer's profile), wheel (which needs maturin), kernel (criterion),
commands (traces, plan, correction), python (arrays of NumPy), page (sizes of its module), peers (other tools, where NumPy,
SciPy, CasADi and JAX are installed), suite (the test command of the README, cold; only if named).

A figure of a benchmark is the median of criterion, and a ratio divides two figures of one run. Figures of commands are wall
time, processor time in user and system mode, and largest resident memory, of one run each; a MB is 10⁶ bytes. A figure
that misses its target is printed in bold; `missed` in the record says why.
"""

import argparse
import gzip
import json
import os
import re
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
PAGE = ROOT / "docs" / "development" / "speed.md"
RECORD = ROOT / "docs" / "development" / "figures.toml"
TARGET = ROOT / "target"
FIGURES = TARGET / "costs.json"
ABBE = TARGET / "release" / "abbe"
DATA = Path(os.environ.get("ABBE_DATA", ROOT.parent / "shared" / "data"))
BENCHES = [("abbe-model", "chain"), ("abbe-identify", "fit"), ("abbe-trace", "trace"), ("abbe-plan", "plan"), ("abbe-codegen", "kernel")]
CACHE, STREAM = "value and eight derivatives, in cache", "value and eight derivatives, streaming"
ALL = "value and all components of a five-axis machine/37 components"
MONTE_CARLO = "Monte Carlo"
# Benchmark, its name in criterion, divisor of the time, unit; reference, its name in criterion, divisor of its time.
LINES = [
    ("value and eight derivatives, columns in cache", f"{CACHE}/generic chain", 1e3, "ns per reading", "hand-written kernel", f"{CACHE}/by hand", 1e3),
    ("the same", f"{CACHE}/generic chain", 1e3, "ns per reading", "num-dual, one reading at a time", f"{CACHE}/generic chain over num-dual, one at a time", 1e3),
    ("the same, a million readings", f"{STREAM}/generic chain", 1e6, "ns per reading", "hand-written kernel", f"{STREAM}/by hand", 1e6),
    ("value and all 37 components of a five-axis machine", ALL, 1e3, "ns per reading", None, None, None),
    ("fit of 1,000 readings, 36 parameters", "fit/1000", 1, "s", None, None, None),
    ("fit of 10,000 readings", "fit/10000", 1, "s", None, None, None),
    ("fit of 100,000 readings", "fit/100000", 1, "s", None, None, None),
    ("fit of 1,000,000 readings, 36 parameters", "fit/1000000", 1, "s", None, None, None),
    ("trace of 3,616 readings, whole library, 199 null residuals, no effect present", "trace/chapter 5, nothing to find", 1, "s", None, None, None),
    ("1,000 Monte Carlo draws of the fit of 3,616 readings", f"{MONTE_CARLO}/a thousand draws of the fit of chapter 5", 1, "s", "1,000 fits", f"{MONTE_CARLO}/one fit of chapter 5", 1e-3),
    ("plan of `chapter5.toml` with the table of effects", "plan/analyse/chapter5 with effects", 1, "s", None, None, None),
    ("equation of the error vector with eight derivatives, as C", "equation/error vector with eight derivatives, as C", 1, "s", None, None, None),
]
# Folder of a session of `sessions_for_speed`, description, targets: wall time in s, memory in MB, processor over wall time.
TRACES = [
    ("harmonic-correlated", "harmonic of order 3, autocorrelation 0.8, 8,184 readings", 2, 250, 1.7),
    ("drift-harmonic-8", "drift and harmonic of order 8, 8,184 readings", 2, 250, 1.7),
    ("ball-drift-harmonic-6", "drift of the spindle ball and harmonic of order 6, 5,784 readings", 2, 250, 1.7),
    ("nothing-6000", "no effect, 6,000 readings", 1, None, None),
    ("nothing-100000", "no effect, 99,044 readings", 8, 600, 1.7),
    ("harmonic-100000", "harmonic of order 3, 99,044 readings", 6, 400, 1.7),
    ("nothing-1000000", "no effect, 990,044 readings", 40, 2000, 1.7),
]
HERMLE, VOLUMETRIC = "sessions/hermle-c600u", "sessions/volumetric"
# Description, arguments, targets as above.
COMMANDS = [
    ("`fit` of 99,044 readings", ["fit", "{folder}/nothing-100000/session.toml"], None, None, None),
    ("`fit` of 990,044 readings", ["fit", "{folder}/nothing-1000000/session.toml"], None, None, 1.7),
    ("`trace sessions/ur10/session.toml`, 11,911 poses", ["trace", "sessions/ur10/session.toml", "--data", str(DATA)], 20, None, 1.7),
    ("`plan chapter5.toml --improve 2`", ["plan", f"{HERMLE}/chapter5.toml", "--improve", "2"], 3, None, 1.7),
    ("`fit --monte-carlo 10000` of the measured session", ["fit", f"{HERMLE}/measured/session.toml", "--monte-carlo", "10000"], None, None, 1.7),
    ("volumetric map of 3,125 points, 33 errors, compensated", ["volumetric", f"{VOLUMETRIC}/machine.toml", "--map", "{folder}/map.csv", "--functions", f"{VOLUMETRIC}/errors.toml", "--correction"], None, None, None),
]
CARGO = ["cargo", "--offline"]


def cost(command, environment=None, cwd=ROOT, output=subprocess.DEVNULL):
    """Wall time, s, processor time, s, and largest resident memory, MB, of a command and of those that it waits for."""
    print("==", *command, file=sys.stderr)
    start = time.perf_counter()
    process = subprocess.Popen(command, cwd=cwd, env=dict(os.environ, **(environment or {})), stdout=output, stderr=subprocess.PIPE)
    errors = process.stderr.read()
    _, status, usage = os.wait4(process.pid, 0)
    wall = time.perf_counter() - start
    code = os.waitstatus_to_exitcode(status)
    if code != 0:
        raise SystemExit(f"{' '.join(command)} ended with {code}:\n{errors.decode(errors='replace')[-2000:]}")
    return {"wall": wall, "cpu": usage.ru_utime + usage.ru_stime, "mb": usage.ru_maxrss * 1024 / 1e6}


class Costs:
    """The rows of the table of costs, by stage: quantity, figure, unit, target, and whether the target is a minimum."""

    def __init__(self):
        self.stages = json.loads(FIGURES.read_text()) if FIGURES.exists() else {}

    def begin(self, stage):
        self.stage = self.stages[stage] = []

    def add(self, quantity, figure, unit, target=None, minimum=False):
        print(f"{quantity}: {figure:.3g} {unit}", file=sys.stderr)
        self.stage.append([quantity, figure, unit, target, minimum])

    def of_command(self, quantity, measured, wall, mb, ratio):
        self.add(f"{quantity}: wall time", measured["wall"], "s", wall)
        self.add(f"{quantity}: processor time", measured["cpu"], "s")
        self.add(f"{quantity}: memory", measured["mb"], "MB", mb)
        # A short command starts and reads on one processor.
        if ratio and measured["wall"] > 1:
            self.add(f"{quantity}: processor time over wall time", measured["cpu"] / measured["wall"], "", ratio, True)

    def save(self):
        TARGET.mkdir(exist_ok=True)
        FIGURES.write_text(json.dumps(self.stages, indent=1))

    def rows(self):
        rows = []
        for stage in STAGES:
            for quantity, figure, unit, target, minimum in self.stages.get(stage, []):
                unit = f" {unit}" if unit else ""
                written = f"{figure:.0f}" if figure >= 1000 else f"{figure:.3g}"
                missed = target is not None and (figure < target if minimum else figure > target)
                limit = "" if target is None else f"{'at least' if minimum else 'at most'} {target:g}{unit}"
                rows.append([quantity, f"**{written}{unit}**" if missed else f"{written}{unit}", limit])
        return rows


def build(costs, arguments):
    # Later stages use what is built here.
    shutil.rmtree(TARGET / "release", ignore_errors=True)
    cold = cost([*CARGO, "build", "--release"])
    costs.add("cold `cargo build --release`: wall time", cold["wall"], "s", 240)
    costs.add("cold `cargo build --release`: processor time", cold["cpu"], "s", 360)
    cost([*CARGO, "build"])
    # A newer file is a changed one. Later stages find it as it was.
    changed = ROOT / "identify" / "src" / "linear.rs"
    before = changed.stat()
    changed.touch()
    again = cost([*CARGO, "build"])
    os.utime(changed, ns=(before.st_atime_ns, before.st_mtime_ns))
    costs.add("`cargo build` after a change in one file of `identify`: wall time", again["wall"], "s", 20)


def wheel(costs, arguments):
    with tempfile.TemporaryDirectory() as folder:
        command = [sys.executable, "-m", "pip", "wheel", "--quiet", "--no-deps", "--no-build-isolation", "--wheel-dir", folder, "./python"]
        path = f"{Path(sys.executable).parent}:{os.environ['PATH']}"
        made = cost(command, {"CARGO_TARGET_DIR": f"{folder}/target", "PATH": path})
        [file] = Path(folder).glob("*.whl")
        size = file.stat().st_size / 1e6
        # For the stage `python`.
        subprocess.run([sys.executable, "-m", "pip", "install", "--quiet", "--no-deps", "--force-reinstall", str(file)], check=True)
    costs.add("wheel, cold: wall time", made["wall"], "s", 360)
    costs.add("wheel, cold: processor time", made["cpu"], "s")
    costs.add("wheel: size", size, "MB", 12)


def kernel(costs, arguments):
    run(arguments.profile, TARGET, None)
    if arguments.native:
        run(arguments.profile, TARGET / "native", "-C target-cpu=native")
    for words, name, limit in [("in cache", f"{CACHE}/generic chain", 9), ("streaming", f"{STREAM}/generic chain", 15)]:
        readings = 1e3 if words == "in cache" else 1e6
        costs.add(f"value and eight derivatives of a reading, {words}", median(TARGET, name) / readings * 1e9, "ns", limit)
    costs.add("fit of 10⁶ readings, 36 parameters", median(TARGET, "fit/1000000"), "s")


def commands(costs, arguments):
    cost([*CARGO, "build", "--release"])
    with tempfile.TemporaryDirectory() as folder:
        there = {"ABBE_SESSIONS": folder}
        cost([*CARGO, "test", "--profile", "checked", "--test", "main", "sessions_for_speed"], there)
        for name, words, *targets in TRACES:
            costs.of_command(f"`trace`, {words}", cost([str(ABBE), "trace", f"{folder}/{name}/session.toml"]), *targets)
        for words, command, *targets in COMMANDS:
            if str(DATA) in command and not DATA.exists():
                print(f"skipped: {words}: no public data at {DATA}", file=sys.stderr)
                continue
            command = [word.format(folder=folder) for word in command]
            costs.of_command(words, cost([str(ABBE), *command]), *targets)


def python(costs, arguments):
    bench = [*CARGO, "bench", "--quiet", "--bench", "session", "--"]
    command = [sys.executable, "python/benches/speed.py", "--json", str(ABBE), *bench]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True)
    if done.returncode:
        print(f"skipped: Python: {done.stderr.strip().splitlines()[-1:]}", file=sys.stderr)
        return
    found = json.loads(done.stdout)
    costs.add("Python, 10⁶ readings of NumPy arrays: peak memory of session and fit over that of the arrays", found["peak over arrays"], "", 1.3)
    for name in ("fit", "predict", "jacobian"):
        costs.add(f"Python: processor time of `{name}` over that in Rust", found[name], "", 1.3)


def page(costs, arguments):
    cost(["npm", "--prefix", "web", "run", "build"])
    [module, *_] = sorted((ROOT / "web" / "dist").rglob("*.wasm"))
    content = module.read_bytes()
    costs.add("module of the page", len(content) / 1e6, "MB", 3.2)
    costs.add("module of the page with gzip", len(gzip.compress(content, 9)) / 1e6, "MB", 1.4)


def peers(costs, arguments):
    done = subprocess.run([arguments.peers, "identify/benches/peers.py", "--json"], cwd=ROOT, capture_output=True, text=True)
    if done.returncode:
        print(f"skipped: other tools: {done.stderr.strip().splitlines()[-1:]}", file=sys.stderr)
        return
    for task, (ours, others) in json.loads(done.stdout).items():
        for name, seconds in others.items():
            # `lm` is the better of SciPy's two; the target is that of its default.
            targets = {"trf": 50, "lm": None, "CasADi": 5} if "fit" in task else {}
            least = next((target for word, target in targets.items() if word in name), 1)
            costs.add(f"{task}: time of {name} over that of Abbe", seconds / ours, "", least, True)


def suite(costs, arguments):
    with tempfile.TemporaryDirectory() as folder:
        cold = cost([*CARGO, "test", "--workspace", "--profile", "checked"], {"CARGO_TARGET_DIR": folder})
    costs.add("test command of the README, cold: wall time", cold["wall"], "s", 540)


STAGES = {"build": build, "wheel": wheel, "kernel": kernel, "commands": commands, "python": python, "page": page, "peers": peers, "suite": suite}


def run(profile, target, flags):
    environment = dict(os.environ, CARGO_TARGET_DIR=str(target))
    if flags:
        environment["RUSTFLAGS"] = flags
    # One command: the dependencies then have the same features for all packages and are built once.
    command = [*CARGO, "bench", "--profile", profile]
    for package, bench in BENCHES:
        command += ["-p", package, "--bench", bench]
    subprocess.run(command, cwd=ROOT, check=True, env=environment)


def median(target, name):
    """Median in seconds; None without a result of criterion."""
    file = target / "criterion" / name / "new" / "estimates.json"
    return json.loads(file.read_text())["median"]["point_estimate"] * 1e-9 if file.exists() else None


def figure(seconds, divisor, unit):
    value = seconds / divisor * (1e9 if unit.startswith("ns") else 1)
    return f"{value:.3g}"


def lines(rows):
    return "\n".join("| " + " | ".join(row) + " |" for row in rows)


def benchmarks(target, native):
    head = ["benchmark", "Abbe", "reference in the same run", "time of Abbe over time of the reference"] + ([] if native is None else ["built for this processor"])
    rows = [head, ["---"] * len(head)]
    for benchmark, name, divisor, unit, reference, other, other_divisor in LINES:
        ours = median(target, name)
        if ours is None:
            continue
        row = [benchmark, f"{figure(ours, divisor, unit)} {unit}", "", ""]
        theirs = median(target, other) if other else None
        if theirs is not None:
            row[2] = f"{reference}: {figure(theirs, other_divisor, unit)}"
            row[3] = f"{(ours / divisor) / (theirs / other_divisor):.2g}"
        if native is not None:
            there = median(native, name)
            theirs_there = median(native, other) if other else None
            beside = "" if theirs_there is None else f"; reference {figure(theirs_there, other_divisor, unit)}"
            row.append("" if there is None else f"{figure(there, divisor, unit)}, {ours / there:.2f} times as fast{beside}")
        rows.append(row)
    return lines(rows)


def fill(file, first, last, text):
    """Replaces the lines of a file between two lines."""
    present = file.read_text()
    lines_between = re.compile(f"^({re.escape(first)}\n).*?^({re.escape(last)})$", re.DOTALL | re.MULTILINE)
    filled, count = lines_between.subn(lambda m: f"{m[1]}{text}\n{m[2]}", present, count=1)
    if count != 1:
        raise SystemExit(f"{file}: expected {first} and then {last}")
    file.write_text(filled)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("stages", nargs="*", metavar="STAGE", help=", ".join(STAGES))
    parser.add_argument("--profile", default="release", help="cargo's build profile for the benchmarks")
    parser.add_argument("--native", action="store_true", help="also benchmark a build with -C target-cpu=native")
    parser.add_argument("--peers", default=sys.executable, metavar="PYTHON", help="the Python that has SciPy, CasADi and JAX")
    parser.add_argument("--read", action="store_true", help="run nothing, use the last figures")
    arguments = parser.parse_args()
    for stage in arguments.stages:
        if stage not in STAGES:
            parser.error(f"there is no stage `{stage}`; stages are {', '.join(STAGES)}")
    # What is built is timed without the network.
    subprocess.run(["cargo", "fetch", "--quiet"], cwd=ROOT)
    costs = Costs()
    named = arguments.stages or [stage for stage in STAGES if stage != "suite"]
    for stage in [] if arguments.read else named:
        costs.begin(stage)
        STAGES[stage](costs, arguments)
        costs.save()
    rows = "\n".join(f"    {json.dumps(row, ensure_ascii=False)}," for row in costs.rows())
    fill(RECORD, '[speed-costs]\ncolumns = ["quantity", "figure", "target"]\nrows = [', "]", rows)
    if arguments.read or "kernel" in named:
        native = TARGET / "native"
        fill(PAGE, "<!-- speeds -->", "<!-- /speeds -->", benchmarks(TARGET, native if native.exists() else None))
    subprocess.run([sys.executable, "tests/manual.py", "--write"], cwd=ROOT, check=True)


if __name__ == "__main__":
    main()
