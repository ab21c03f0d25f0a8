"""Counts the instructions of eight commands, and fails if one takes more than 1.05 times those of benches/instructions.json.

    python benches/instructions.py target/checked/abbe            compares
    python benches/instructions.py target/checked/abbe --renew    writes the record; the commit says why it changes

Valgrind counts on one thread, with its own model of a processor and an empty environment, so the count needs no quiet machine: it
repeats to 0.1 %. It depends on the build profile (`checked`, with the features of `cargo test --workspace`), on the compiler and on
Valgrind, whose versions are in the record.
"""

import argparse
import json
import os
import re
import shutil
import subprocess
import sys
import tempfile
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
RECORD = ROOT / "benches" / "instructions.json"
MOST = 1.05
ENVIRONMENT = {"RAYON_NUM_THREADS": "1", "PATH": "/usr/bin:/bin"}
SESSIONS = ROOT / "sessions"
HERMLE = SESSIONS / "hermle-c600u"
MEASURED = HERMLE / "measured"


def commands(command, folder):
    """Name and arguments of each command. Makes the files in the folder that they need."""
    plan = folder / "plan.toml"
    shutil.copy(HERMLE / "machine.toml", folder)
    text = (HERMLE / "chapter5.toml").read_text()
    # Finer steps than those of the tests: 25,000 readings.
    for step, finer in [("step_deg = 0.25", "step_deg = 0.0866"), ("step_deg = 0.5", "step_deg = 0.1732")]:
        if step not in text:
            raise SystemExit(f"{HERMLE / 'chapter5.toml'}: expected {step}")
        text = text.replace(step, finer)
    plan.write_text(text)
    subprocess.run([command, "simulate", plan, "--out", folder / "long", "--quiet"], check=True, stdout=subprocess.DEVNULL)
    started = folder / "import"
    started.mkdir()
    shutil.copy(HERMLE / "machine.toml", started)
    shutil.copy(HERMLE / "chapter5.toml", started)
    return {
        "fit of the bundled session": ["fit", MEASURED / "session.toml"],
        "fit of 25,000 readings": ["fit", folder / "long" / "session.toml"],
        "fit of poses": ["fit", SESSIONS / "pose" / "session.toml"],
        "plan": ["plan", SESSIONS / "tilting-head" / "session.toml"],
        "trace": ["trace", SESSIONS / "table-and-head" / "measured" / "session.toml"],
        "equation": ["equation", HERMLE / "chapter5.toml", "--test", "A100"],
        "import": ["import", *sorted(MEASURED.glob("*.csv")), "--session", started / "chapter5.toml"],
        "simulate": ["simulate", HERMLE / "chapter5.toml", "--out", folder / "simulated"],
    }


def count(command, arguments):
    """The instructions of a command."""
    call = ["valgrind", "--tool=callgrind", "--callgrind-out-file=/dev/null", command, *arguments]
    done = subprocess.run(call, env=ENVIRONMENT, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
    found = re.search(r"Collected : (\d+)", done.stderr)
    if done.returncode or not found:
        raise SystemExit(f"{' '.join(map(str, call))} ended with {done.returncode}:\n{done.stderr[-2000:]}")
    return int(found[1])


def version(program):
    return subprocess.run([program, "--version"], capture_output=True, text=True, check=True).stdout.strip()


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("command", type=Path, help="abbe, built in the profile `checked`")
    parser.add_argument("--renew", action="store_true", help="write the record")
    arguments = parser.parse_args()
    command = arguments.command.resolve()
    with tempfile.TemporaryDirectory() as folder, ThreadPoolExecutor(os.cpu_count()) as pool:
        called = commands(command, Path(folder))
        counted = dict(zip(called, pool.map(lambda call: count(command, call), called.values())))
    tools = {program: version(program) for program in ("valgrind", "rustc")}
    if arguments.renew:
        RECORD.write_text(json.dumps({"tools": tools, "instructions": counted}, indent=2) + "\n")
        return
    if not RECORD.exists():
        raise SystemExit(f"there is no {RECORD.relative_to(ROOT)}: write it with --renew")
    record = json.loads(RECORD.read_text())
    recorded = record["instructions"]
    if recorded.keys() != counted.keys():
        raise SystemExit(f"{RECORD.relative_to(ROOT)} has other commands: renew it with --renew")
    exceeded = []
    for name, instructions in counted.items():
        ratio = instructions / recorded[name]
        print(f"{name}: {instructions:,} instructions, {ratio:.3f} of the record")
        exceeded += [name] if ratio > MOST else []
    if exceeded:
        others = [f"{program} is {tools[program]}, that of the record {record['tools'][program]}" for program in tools if tools[program] != record["tools"][program]]
        sys.exit(
            f"{', '.join(exceeded)}: more than {MOST} times the instructions of {RECORD.relative_to(ROOT)}"
            + "".join(f"; {other}" for other in others)
            + f". Find what takes them with `valgrind --tool=callgrind` and `callgrind_annotate --inclusive=yes`. If they are worth it, run"
            f" `python benches/instructions.py {arguments.command} --renew`, commit the record, and say why in the commit"
        )


if __name__ == "__main__":
    main()
