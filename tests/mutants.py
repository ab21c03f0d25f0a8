"""Tests mutants of `model`, `identify` and `codegen`, many in one build.

cargo-mutants builds the workspace for each mutant, which takes longer than the tests. This script takes its list of mutants and writes a systematic
sample into a copy of the workspace, each behind a condition (`if crate::mutant(17) { changed body } else { body }`). It builds the copy once and selects
each mutant by ABBE_MUTANT. First each test runs alone and lists the mutants whose code it reaches: only these tests can catch them. For a mutant they run
in stages until one fails, the cheapest first, then examples of the documentation, and kept answers last: what only they catch is reported apart, since a
kept answer shows that a figure changed, not that it is wrong. The order of the mutants is random, so that an interrupted run is a random sample too.
Mutants with a result in the output file are not tested again. The last lines are the rates by package.

    git worktree add ../mutants
    python tests/mutants.py --sample abbe-identify=200 --sample abbe-model=120 --sample abbe-codegen=80 --seed 2 --copy ../mutants --out mutants.jsonl
"""

import argparse
import concurrent.futures
import dataclasses
import json
import os
import pathlib
import random
import re
import signal
import subprocess
import sys
import tempfile
import time

SWITCH = """
/// Whether the mutant of this number is selected. Its first call adds the number to the file ABBE_MUTANTS_REACHED.
#[doc(hidden)]
pub fn mutant(number: usize) -> bool {
    static SELECTED: std::sync::OnceLock<usize> = std::sync::OnceLock::new();
    static REACHED: [std::sync::atomic::AtomicBool; 4096] = [const { std::sync::atomic::AtomicBool::new(false) }; 4096];
    if !REACHED[number].load(std::sync::atomic::Ordering::Relaxed) && !REACHED[number].swap(true, std::sync::atomic::Ordering::Relaxed) {
        if let Some(file) = std::env::var_os("ABBE_MUTANTS_REACHED") {
            if let Ok(mut file) = std::fs::OpenOptions::new().append(true).create(true).open(file) {
                let _ = std::io::Write::write_all(&mut file, format!("{number}\\n").as_bytes());
            }
        }
    }
    *SELECTED.get_or_init(|| std::env::var("ABBE_MUTANT").ok().and_then(|text| text.parse().ok()).unwrap_or(0)) == number
}
"""

# Tests of the workspace or of the operating system, not of the computations of the crates.
EXCLUDED_TESTS = ("supply_chain", "early_returns", "kill::", "another_build", "report::browser", "repeatability", "codes::")
KEPT = "::kept::"
PROFILE = ["--profile", "checked"]


def offset(text, place):
    """Offset in a text of a line and a column, both counted from one."""
    start = 0
    for _ in range(place["line"] - 1):
        start = text.index("\n", start) + 1
    return start + place["column"] - 1


def body_of(text, function):
    """Begin and end of the block of a function."""
    begin, end = offset(text, function["span"]["start"]), offset(text, function["span"]["end"])
    name = function["function_name"].split("::")[-1].split("<")[0]
    head = re.compile(r"\bfn\s+" + re.escape(name) + r"\b").search(text, begin, end)
    return text.index("{", head.end()), end


def changed(text, mutant, begin, end):
    """The block of a function in the mutant."""
    first, last = offset(text, mutant["span"]["start"]), offset(text, mutant["span"]["end"])
    return text[begin:first] + mutant["replacement"] + text[last:end]


def write(copy, originals, mutants):
    """Writes all mutants into the copy; those of one function are nested."""
    for file, text in originals.items():
        functions = {}
        for mutant in (m for m in mutants if m["file"] == file):
            functions.setdefault(body_of(text, mutant["function"]), []).append(mutant)
        for (begin, end), group in sorted(functions.items(), reverse=True):
            block = text[begin:end]
            for mutant in group:
                number = mutant["number"]
                block = "{ if crate::mutant(%d) /*<%d*/ %s /*%d>*/ else %s }" % (
                    number, number, changed(originals[file], mutant, begin, end), number, block)
            text = text[:begin] + block + text[end:]
        (copy / file).write_text(text)


def at_fault(copy, span, mutants):
    """Numbers of the mutants that a compiler error points into; all mutants of the function if it points between them."""
    text = (copy / span["file_name"]).read_bytes()
    place = span["byte_start"]
    inside = [
        m["number"] for m in mutants if m["file"] == span["file_name"]
        and (b := text.find(b"/*<%d*/" % m["number"])) >= 0 and b <= place < text.find(b"/*%d>*/" % m["number"])
    ]
    if inside:
        # Of nested mutants the innermost text is the one written last.
        return [max(inside, key=lambda number: text.find(b"/*<%d*/" % number))]
    before = [(text.rfind(b"/*<%d*/" % m["number"], 0, place + 200), m) for m in mutants if m["file"] == span["file_name"]]
    function = max(before, key=lambda entry: entry[0])[1]["function"]
    return [m["number"] for m in mutants if m["file"] == span["file_name"] and m["function"] == function]


def spans_of(message):
    for span in message["spans"]:
        if span["is_primary"]:
            yield span


def exclude_mutants_that_do_not_build(copy, originals, mutants, packages):
    """Writes the mutants and checks repeatedly until the remaining ones build; returns these and the excluded ones."""
    out = []
    while True:
        write(copy, originals, mutants)
        asked = [word for package in packages for word in ("-p", package)]
        run = subprocess.run(["cargo", "check", *asked, "--message-format=json", *PROFILE], cwd=copy, capture_output=True, text=True)
        if run.returncode == 0:
            return mutants, out
        faults = set()
        for line in run.stdout.splitlines():
            message = json.loads(line).get("message")
            if isinstance(message, dict) and message["level"] == "error":
                for span in spans_of(message):
                    if any(m["file"] == span["file_name"] for m in mutants):
                        faults.update(at_fault(copy, span, mutants))
        if not faults:
            sys.exit("the copy does not build for another reason:\n" + run.stderr[-3000:])
        out += [m for m in mutants if m["number"] in faults]
        mutants = [m for m in mutants if m["number"] not in faults]


# Folders whose tests cover a package, its own first.
TESTED_BY = {
    "abbe-model": ("model", "files", "codegen", "identify", "trace", "plan", "apply", "."),
    "abbe-files": ("files", "identify", "trace", "plan", "apply", "."),
    "abbe-identify": ("identify", "trace", "plan", "apply", "."),
    "abbe-trace": ("trace", "plan", "apply", "."),
    "abbe-plan": ("plan", "."),
    "abbe-apply": ("apply", "."),
    "abbe-codegen": ("codegen", "."),
}


def binaries(copy, asked):
    """The test programs of packages, each with the working folder of its tests."""
    run = subprocess.run(["cargo", "test", *asked, "--no-run", "--message-format=json", *PROFILE], cwd=copy, stdout=subprocess.PIPE, text=True, check=True)
    found = []
    for line in run.stdout.splitlines():
        message = json.loads(line)
        if message.get("reason") == "compiler-artifact" and message.get("executable") and message["profile"]["test"]:
            found.append((message["executable"], str(pathlib.Path(message["manifest_path"]).parent)))
    return found


@dataclasses.dataclass
class Test:
    """A test of a program: its working folder, its name, its seconds, the mutants whose code it reaches."""

    program: str
    folder: str
    name: str
    seconds: float = 0.0
    reached: frozenset = frozenset()


def run_tests(program, folder, names, limit, **environment):
    """Status (0 passed, 1 failed, 2 timeout) and output."""
    environment = dict(os.environ, CI="true", INSTA_UPDATE="no", RUSTC_BOOTSTRAP="1", CARGO_MANIFEST_DIR=folder, **environment)
    command = [program, "-Z", "unstable-options", "--fail-fast", "--exact", *names]
    process = subprocess.Popen(command, cwd=folder, env=environment, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, start_new_session=True)
    try:
        printed, _ = process.communicate(timeout=limit)
        return (0 if process.returncode == 0 else 1), printed
    except subprocess.TimeoutExpired:
        os.killpg(process.pid, signal.SIGKILL)
        process.wait()
        return 2, ""


def examples_fail(copy, number):
    """Whether an example of the documentation fails. Those of one package alone would be built with other features of all dependencies."""
    command = ["cargo", "test", "--doc", "--workspace", *PROFILE]
    run = subprocess.run(command, cwd=copy, env=dict(os.environ, ABBE_MUTANT=str(number)), capture_output=True)
    return run.returncode != 0


def measured(test):
    """The test with its seconds and the mutants that it reaches, from one run of it alone without a mutant."""
    with tempfile.NamedTemporaryFile("r") as log:
        begin = time.time()
        status, printed = run_tests(test.program, test.folder, [test.name], 1800, ABBE_MUTANT="0", ABBE_MUTANTS_REACHED=log.name)
        if status:
            print(f"excluded, since it fails without a mutant: {test.name}\n{printed[-1000:]}", flush=True)
            return None
        return dataclasses.replace(test, seconds=time.time() - begin, reached=frozenset(map(int, log.read().split())))


def measured_tests(programs, slowest_s):
    """All tests, the cheapest first, without tests slower than `slowest_s`."""
    tests = []
    for program, folder in programs:
        listed = subprocess.run([program, "--list"], cwd=folder, capture_output=True, text=True, check=True).stdout
        names = [line[:-6] for line in listed.splitlines() if line.endswith(": test") and not any(part in line for part in EXCLUDED_TESTS)]
        tests += [Test(program, folder, name) for name in names]
    with concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
        tests = sorted((test for test in pool.map(measured, tests) if test), key=lambda test: test.seconds)
    for test in tests:
        if test.seconds > slowest_s:
            print(f"excluded as too slow: {test.name}, {test.seconds:.0f} s", flush=True)
    return [test for test in tests if test.seconds <= slowest_s]


def stages_of(tests, folders, number, kept):
    """Stages of growing cost of the tests in these folders that reach a mutant, in their order. Either of kept answers or of all others."""
    tests = [test for test in tests if number in test.reached and test.folder in folders and (KEPT in test.name) == kept]
    programs = sorted({(test.program, test.folder) for test in tests}, key=lambda program: folders.index(program[1]))
    stages, bound = [], 0.5
    while tests:
        now = [test for test in tests if test.seconds <= bound]
        tests = [test for test in tests if test.seconds > bound]
        for program in programs:
            mine = [test for test in now if (test.program, test.folder) == program]
            if mine:
                stages.append((*program, [test.name for test in mine], sum(test.seconds for test in mine)))
        bound *= 4
    return stages


def listed(copy, asked, only):
    """A sample of the list of cargo-mutants for a package: `abbe-model=45+11` is one in 45 from the eleventh, counted from zero."""
    package, every, first = re.fullmatch(r"([\w-]+)=(\d+)(?:\+(\d+))?", asked).groups()
    run = subprocess.run(["cargo", "mutants", "--list", "--json", "-p", package], cwd=copy, capture_output=True, text=True, check=True)
    found = [m for m in json.loads(run.stdout) if m["function"] and (not only or re.search(only, m["name"]))]
    return found[int(first or 0)::int(every)]


def first_failing(stages, mutant):
    """Verdict of the first stage that fails, and the tests that fail in it."""
    for program, folder, names, seconds in stages:
        status, printed = run_tests(program, folder, names, 60 + 10 * seconds, ABBE_MUTANT=str(mutant["number"]))
        if status:
            return ["", "caught", "out of time"][status], " ".join(re.findall(r"^test (\S+) \.\.\. FAILED", printed, re.M)[:3])
    return "missed", ""


def rates(results):
    """Lines with the share of caught mutants by package and of all, with and without the kept answers. A mutant that runs out of time is caught."""
    packages = sorted({result["package"] for result in results})
    for package in [*packages, "all"]:
        mine = [result for result in results if package in (result["package"], "all")]
        caught = [result for result in mine if result["verdict"] != "missed"]
        without = [result for result in caught if not result["kept_only"]]
        share = [f"{len(part)} of {len(mine)} = {100 * len(part) / len(mine):.0f} ± {100 * error(len(part), len(mine)):.0f} %" for part in (caught, without)]
        yield f"{package}: caught {share[0]}; without the kept answers {share[1]}"


def error(hits, count):
    """Standard error of a share, from a uniform prior: never zero."""
    share = (hits + 1) / (count + 2)
    return (share * (1 - share) / (count + 3)) ** 0.5


def main():
    ask = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    ask.add_argument("--sample", required=True, action="append", metavar="PACKAGE=N[+FIRST]", help="one mutant of N of a package; may be repeated")
    ask.add_argument("--only", help="only mutants whose names match this regular expression")
    ask.add_argument("--own", action="store_true", help="only the tests of the package itself: quick, and a lower bound of what is caught")
    ask.add_argument("--seed", type=int, default=1, help="of the order of the mutants")
    ask.add_argument("--slowest", type=float, default=32.0, help="tests that take longer are excluded, s")
    ask.add_argument("--copy", type=pathlib.Path, required=True, help="a copy of the workspace, which is overwritten")
    ask.add_argument("--out", type=pathlib.Path, required=True, help="results, one line of JSON per mutant")
    given = ask.parse_args()
    copy = given.copy.resolve()

    sample = [m for asked in given.sample for m in listed(copy, asked, given.only)]
    for number, mutant in enumerate(sample, 1):
        mutant["number"] = number
    packages = sorted({m["package"] for m in sample})
    libraries = [copy / package.removeprefix("abbe-") / "src/lib.rs" for package in packages]
    originals = {m["file"]: (copy / m["file"]).read_text() for m in sample}
    plain = {library: library.read_text() for library in libraries}
    try:
        for library, text in plain.items():
            if str(library.relative_to(copy)) in originals:
                sys.exit("a mutant in lib.rs")
            library.write_text(text + SWITCH)
        kept, unviable = exclude_mutants_that_do_not_build(copy, originals, list(sample), packages)
        print(f"{len(sample)} mutants, {len(unviable)} do not build", flush=True)
        random.Random(given.seed).shuffle(kept)
        asked = [word for package in packages for word in ("-p", package)] if given.own else ["--workspace"]
        tests = measured_tests(binaries(copy, asked), given.slowest)
        tested_by = {package: TESTED_BY[package][:1] if given.own else TESTED_BY[package] for package in packages}
        folders = {package: [str((copy / folder).resolve()) for folder in tested_by[package]] for package in packages}
        print(f"{len(tests)} tests of {sum(test.seconds for test in tests):.0f} s", flush=True)
        reached = frozenset().union(*(test.reached for test in tests))
        print(*(f"reached by no test: {m['name']}" for m in kept if m["number"] not in reached), sep="\n", flush=True)
        tried = {json.loads(line)["name"] for line in given.out.read_text().splitlines()} if given.out.exists() else set()
        with given.out.open("a") as out:
            for mutant in (m for m in kept if m["name"] not in tried):
                begin = time.time()
                others, kept_answers = [stages_of(tests, folders[mutant["package"]], mutant["number"], of_kept) for of_kept in (False, True)]
                verdict, by = first_failing(others, mutant)
                if verdict == "missed" and examples_fail(copy, mutant["number"]):
                    verdict, by = "caught", "an example of the documentation"
                kept_only = verdict == "missed"
                if kept_only:
                    verdict, by = first_failing(kept_answers, mutant)
                result = {"name": mutant["name"], "package": mutant["package"], "verdict": verdict, "by": by, "kept_only": kept_only and verdict != "missed"}
                result["seconds"] = round(time.time() - begin, 1)
                print(json.dumps(result), file=out, flush=True)
                print(f"{verdict:12} {mutant['name']}", flush=True)
        print(*rates([json.loads(line) for line in given.out.read_text().splitlines()]), sep="\n")
    finally:
        for file, text in (plain | {copy / file: text for file, text in originals.items()}).items():
            file.write_text(text)


if __name__ == "__main__":
    main()
