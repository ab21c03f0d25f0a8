"""Runs the benchmarks and writes their table into docs/development/speed.md, between `<!-- speeds -->` and `<!-- /speeds -->`.

    python benches/table.py                      the release profile
    python benches/table.py --profile checked    another profile
    python benches/table.py --native             also a build for the present processor, in target/native
    python benches/table.py --read               no run: the last results of criterion

Every figure is the median of criterion. A ratio divides two medians of one run. `identify/benches/peers.py` compares with other tools.
"""

import argparse
import json
import os
import re
import subprocess
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
BENCHES = [("abbe-model", "chain"), ("abbe-identify", "fit"), ("abbe-trace", "trace"), ("abbe-codegen", "kernel")]
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
    ("equation of the error vector with eight derivatives, as C", "equation/error vector with eight derivatives, as C", 1, "s", None, None, None),
]


def run(profile, target, flags):
    environment = dict(os.environ, CARGO_TARGET_DIR=str(target))
    if flags:
        environment["RUSTFLAGS"] = flags
    # One command: the dependencies then have the same features for all packages and are built once.
    command = ["cargo", "bench", "--profile", profile]
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


def table(target, native):
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
    return "\n".join("| " + " | ".join(row) + " |" for row in rows)


def fill(file, text):
    present = file.read_text()
    filled, count = re.subn(r"(<!-- speeds -->\n).*?(<!-- /speeds -->)", lambda m: f"{m[1]}{text}\n{m[2]}", present, flags=re.S)
    if count != 1:
        raise SystemExit(f"{file}: expected one pair of <!-- speeds --> and <!-- /speeds -->, found {count}")
    file.write_text(filled)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--profile", default="release", help="cargo's build profile")
    parser.add_argument("--native", action="store_true", help="also benchmark a build with -C target-cpu=native")
    parser.add_argument("--read", action="store_true", help="run nothing, use the last results of criterion")
    arguments = parser.parse_args()
    target, native = ROOT / "target", ROOT / "target" / "native" if arguments.native else None
    if not arguments.read:
        run(arguments.profile, target, None)
        if native:
            run(arguments.profile, native, "-C target-cpu=native")
    fill(ROOT / "docs" / "development" / "speed.md", table(target, native))


if __name__ == "__main__":
    main()
