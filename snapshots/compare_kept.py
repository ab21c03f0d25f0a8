"""Compares kept answers of two versions after the keys of JSON documents were renamed.

    python3 snapshots/compare_kept.py OLD_DIR NEW_DIR

Reads every kept__*.snap of both folders. Maps each line of a JSON document of the old version to its path in the new version
and compares the values: numbers to nine digits, strings by the numbers that they contain. Compares the rows of CSV files in the
same way. Terminal output is not compared. Prints one line per file and every difference; exits with 1 if there is one.
"""

import pathlib
import re
import sys

# Old path (a regular expression) -> new path, in this order.
RENAMED = [
    (r"\.parameters\[(\d+)\]\.(gum_interval)\[0\]", r".parameters[\1].\2.low"),
    (r"\.parameters\[(\d+)\]\.(gum_interval)\[1\]", r".parameters[\1].\2.high"),
    (r"\.(symmetric|shortest)\[0\]", r".\1_interval.low"),
    (r"\.(symmetric|shortest)\[1\]", r".\1_interval.high"),
    (r"\.(symmetric|shortest)_um\[0\]", r".\1_interval_um.low"),
    (r"\.(symmetric|shortest)_um\[1\]", r".\1_interval_um.high"),
    (r"\.end_differences\[0\]", ".endpoint_differences.low"),
    (r"\.end_differences\[1\]", ".endpoint_differences.high"),
    (r"\.end_u$", ".endpoint_u"),
    (r"\.monte_carlo\.coverage$", ".monte_carlo.coverage_probability"),
    (r"\.unconverged$", ".unconverged_runs"),
    (r"\.numbers\[", ".shape_parameters["),
    (r"\.indistinguishable$", ".explanation_count"),
    (r"\.separation\.minutes$", ".separation.duration_min"),
    (r"(\.separating_tests\[\d+\])\.minutes$", r"\1.duration_min"),
    (r"(\.separating_tests\[\d+\])\.separates$", r"\1.separated_count"),
    (r"(\.separating_tests\[\d+\])\.of$", r"\1.alternative_count"),
    (r"heldout_fall_um$", "heldout_decrease_um"),
    (r"^\.moved(\[\d+\])\.by$", r".changed_parameters\1.change"),
    (r"^\.moved\b", ".changed_parameters"),
    (r"^\.candidates_seen$", ".candidates_detectable"),
    (r"^\.rejected\b", ".outliers"),
    (r"^\.unknowns$", ".parameter_count"),
    (r"^\.values$", ".value_count"),
    (r"^\.rank_before$", ".rank_without_conditions"),
    (r"\.not_told\b", ".not_identifiable"),
    (r"\.(conflicts|suggestions)(\[\d+\])\.words$", r".\1\2.description"),
    # Plans.
    (r"^\.setups$", ".setup_count"),
    (r"^\.blind\b", ".unidentifiable"),
    (r"^\.held_by_setup\b", ".determined_by_prior"),
    (r"^\.without(\[\d+\])\.variance_inflation(\[\d+\])\[0\]", r".leave_one_out\1.variance_inflation\2.id"),
    (r"^\.without(\[\d+\])\.variance_inflation(\[\d+\])\[1\]", r".leave_one_out\1.variance_inflation\2.factor"),
    (r"^\.without\b", ".leave_one_out"),
    (r"\.u_others_known$", ".conditional_u"),
    (r"\.shared_with\[", ".correlated_with["),
    (r"\.largest_in$", ".largest_in_test"),
    (r"\.budget(\[\d+\])\.from$", r".budget\1.source"),
    (r"^\.indices\.seen$", ".indices.identifiable_count"),
    (r"^\.indices\.errors$", ".indices.error_count"),
    (r"^\.effects\.significance$", ".effects.significance_level"),
    (r"^\.effects\.significance_corrected$", ".effects.significance_level_corrected"),
    (r"^\.effects\.effects_searched$", ".effects.effects_screened"),
    (r"\.detectable_searched$", ".detectable_amplitude_screened"),
    (r"\.detectable$", ".detectable_amplitude"),
    (r"\.surviving_share$", ".residual_share"),
    # Next tests.
    (r"^\.improvement\.figure$", ".improvement.criterion"),
    (r"^\.improvement\.menu_entries$", ".improvement.candidate_tests"),
    (r"^(\.improvement\..*)\.minutes$", r"\1.duration_min"),
    (r"^(\.improvement\..*)\.opens\b", r"\1.makes_identifiable"),
    (r"^(\.improvement\..*uncertainties(?:_before)?\[\d+\])\[0\]", r"\1.id"),
    (r"^(\.improvement\..*uncertainties(?:_before)?\[\d+\])\[1\]", r"\1.u"),
    (r"^(\.ranges\[\d+\]\.range)\[0\]", r"\1.low"),
    (r"^(\.ranges\[\d+\]\.range)\[1\]", r"\1.high"),
    (r"^(\.ranges\[\d+\])\.least\[0\]", r"\1.minimum_range.low"),
    (r"^(\.ranges\[\d+\])\.least\[1\]", r"\1.minimum_range.high"),
    (r"^(\.ranges\[\d+\])\.least$", r"\1.minimum_range"),
    # Methods, maps, repeated fits, simulations.
    (r"^(\.centres\[\d+\])\.across\[(\d)\]", r"\1.offsets[\2].direction"),
    (r"^(\.centres\[\d+\])\.offset_um\[(\d)\]", r"\1.offsets[\2].offset_um"),
    (r"^(\.centres\[\d+\])\.u_um\[(\d)\]", r"\1.offsets[\2].u_um"),
    (r"^(\.centres\[\d+\])\.shares\[(\d+)\]\[0\]", r"\1.offsets[0].sensitivities[\2].id"),
    (r"^(\.centres\[\d+\])\.shares\[(\d+)\]\[1\]\[(\d)\]", r"\1.offsets[\3].sensitivities[\2].value"),
    (r"^\.places$", ".points"),
    (r"^\.largest_at(\[\d+\])\[0\]", r".largest_at\1.axis"),
    (r"^\.largest_at(\[\d+\])\[1\]", r".largest_at\1.position"),
    (r"^\.coordinates\[0\]", ".coordinates.x"),
    (r"^\.coordinates\[1\]", ".coordinates.y"),
    (r"^\.coordinates\[2\]", ".coordinates.z"),
    (r"^\.by_axis(\[\d+\])\[0\]", r".by_axis\1.axis"),
    (r"^\.by_axis(\[\d+\])\[1\]", r".by_axis\1"),
    (r"^\.deviating(\[\d+\])\.by$", r".deviating\1.deviation"),
    (r"^\.session$", ".written_session"),
]

# Phrases of the old version whose words for a number became digits.
REPHRASED = [("grows by half", "increases by 50 %")]

NUMBER = re.compile(r"(?<![A-Za-z_])[-−+]?\d+(?:\.\d+)?(?:[eE][-+]?\d+)?")


def sections(text):
    """The parts of a kept answer: (name of the file or command, lines)."""
    found, name, lines = [], "", []
    for line in text.splitlines():
        begins = re.fullmatch(r"[\w./-]+\.\w+:", line)
        if line.startswith("$ abbe ") or begins:
            found.append((name, lines))
            name, lines = line.rstrip(":"), []
        else:
            lines.append(line)
    found.append((name, lines))
    return found


def values(lines):
    """The values of a JSON document by their paths."""
    found = {}
    for line in lines:
        match = re.match(r"(\..*?): (.*)$", line)
        if match and "entries" not in match.group(2):
            found[match.group(1)] = match.group(2)
    return found


def renamed(old):
    """The old values by their new paths."""
    found, named = {}, {}
    for path, value in old.items():
        pair = re.fullmatch(r"(.*\.combination)\[(\d+)\]\[([01])\]", path)
        if pair:
            key = (pair.group(1), pair.group(2))
            if pair.group(3) == "0":
                named[key] = value.strip('"')
                continue
            path = f"{pair.group(1)}.{named[key]}"
        for pattern, by in RENAMED:
            path = re.sub(pattern, by, path)
        for phrase, by in REPHRASED:
            value = value.replace(phrase, by)
        found[path] = value
    return found


def numbers(text):
    return [float(number.replace("−", "-")) for number in NUMBER.findall(text)]


def equal(a, b):
    return len(a) == len(b) and all(
        abs(x - y) <= 1e-7 + 1e-6 * max(abs(x), abs(y)) for x, y in zip(a, b)
    )


def main(old_folder, new_folder):
    faults = 0
    for old_file in sorted(pathlib.Path(old_folder).glob("kept__*.snap")):
        new_file = pathlib.Path(new_folder) / old_file.name
        new = {}
        for name, lines in sections(new_file.read_text()):
            new.setdefault(name, lines)
        counts = {"numbers": 0, "strings": 0, "reworded": 0, "csv": 0}
        told = []
        for name, lines in sections(old_file.read_text()):
            kind = name.rsplit(".", 1)[-1]
            if name.startswith("$") or kind not in ("json", "csv"):
                continue
            if name not in new:
                told.append(f"{name}: is missing")
                continue
            if kind == "csv":
                a, b = ([n for line in part if not line.startswith("#") for n in numbers(line)] for part in (lines, new[name]))
                counts["csv"] += len(a)
                if not equal(a, b):
                    told.append(f"{name}: other numbers")
                continue
            now = values(new[name])
            for path, value in renamed(values(lines)).items():
                if path not in now:
                    told.append(f"{name}{path}: is missing (was {value})")
                elif value.startswith('"') or now[path].startswith('"'):
                    counts["strings"] += 1
                    counts["reworded"] += value != now[path]
                    if not equal(numbers(value), numbers(now[path])):
                        told.append(f"{name}{path}: {value} -> {now[path]}")
                elif value in ("null", "true", "false") or not equal(numbers(value), numbers(now[path])):
                    if value != now[path]:
                        told.append(f"{name}{path}: {value} -> {now[path]}")
                else:
                    counts["numbers"] += 1
        faults += len(told)
        print(
            f"{old_file.stem}: {counts['numbers']} numbers equal, {counts['strings']} strings with equal numbers "
            f"({counts['reworded']} reworded), {counts['csv']} numbers of CSV files, {len(told)} differences"
        )
        for line in told:
            print(f"    {line}")
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:3]))
