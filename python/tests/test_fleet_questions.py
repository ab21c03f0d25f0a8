"""The ten queries of docs/guide/fleet.md, against answers that NumPy computes from the results themselves."""

import json
import shutil
from collections import Counter, defaultdict
from datetime import datetime
from itertools import combinations, groupby
from statistics import median, stdev

import numpy as np
import pytest
from fleets import ball_bar, queries

import abbe.fleet

pytest.importorskip("distributed")
pytest.importorskip("duckdb")
pytest.importorskip("pyarrow")

MONTHS = 6
LATEST = "M2"


def measure(place, machine, date, seed, plan=None, values=None, effect=None):
    """Save a simulated session. The readings may hold an effect that the session does not declare."""
    about, plan = {"serial_number": machine, "date": date}, plan or {}
    values = {"EX0C": 10.0, "EY0C": -5.0, **(values or {})}
    place.parent.mkdir(parents=True, exist_ok=True)
    ball_bar(about, **plan).simulate(values, seed=seed).save(place)
    if effect:
        component, order, amplitude_um = effect
        true = ball_bar(about, **plan)
        true.add_effect(component=component, driver="C", shape="harmonic", order=order)
        values[f"{component}~C:h{order}.amplitude"] = amplitude_um
        true.simulate(values, seed=seed).save(place.with_name("true"))
        shutil.copy(place.with_name("true") / "C125.csv", place / "C125.csv")
        shutil.rmtree(place.with_name("true"))


@pytest.fixture(scope="module")
def fleet(tmp_path_factory):
    """Machines M0 (drifts, measured once before), M1 (its model cannot be read; noisy), M2 (an effect, the latest
    session) and M3 (two sessions with another effect, two without a parameter, two that cannot be read)."""
    place = tmp_path_factory.mktemp("asked")
    sessions = place / "fleet"
    measure(sessions / "M0" / "before", "M0", "2022-11-05", 99, values={"EX0C": 30.0})
    for month in range(MONTHS):
        dates = [f"2024-{month + 1:02}-{day:02}T08:00:00" for day in (5, 9, 20, 14)]
        places = [sessions / f"M{machine}" / f"{month:02}" for machine in range(4)]
        measure(places[0], "M0", dates[0], month + 1, values={"EX0C": 10.0 + 0.4 * month})
        measure(places[1], "M1", dates[1], month + 11, {"noise_um": 0.5})
        measure(places[2], "M2", dates[2], month + 21, effect=("EZC", 2, 3.0))
        other = {"errors": ("EX0C", "EY0C", "EZ0C"), "z_mm": 75 if month >= 2 else 0}
        measure(places[3], "M3", dates[3], month + 31, other, effect=("EXC", 3, 2.0) if month in (2, 3) else None)
        if month >= 4:
            (places[3] / "C125.csv").write_text("c_deg,length_mm\n0,many\n")
    # The latest session of all has an estimate, and a model that cannot be validated.
    models = place / "models"
    models.mkdir()
    for machine in ("M1", LATEST):
        (models / f"{machine}.json").write_text("{}")
    out = place / "out"
    run = abbe.fleet.run(sessions, out, workers=1, progress=False, models=models)
    assert (run.computed, len(run.failed), run.lost) == (4 * MONTHS + 1, 2 * MONTHS + 2, [])
    return out


@pytest.fixture(scope="module")
def records(fleet):
    """The records of the sessions, with the session file and the date."""
    found = []
    for file in sorted((fleet / "sessions").rglob("*.json")):
        note = json.loads(file.read_text())
        record = json.loads((fleet / "results" / note["key"][:2] / f"{note['key']}.json").read_text())
        # A session that cannot be read has no date and no machine.
        record["when"] = record["date"] and datetime.fromisoformat(record["date"])
        found.append({**record, "file": note["file"]})
    return found


def fitted(records):
    return [record for record in records if record["model"]]


def series(records):
    """Date, value and u of the identifiable parameters that have a history, by machine, parameter and unit."""
    found = defaultdict(list)
    for record in sorted(fitted(records), key=lambda record: record["when"]):
        for own in record["model"]["parameters"]:
            if "[" not in own["id"] and not own["id"].endswith(".phase"):
                key = (record["machine_id"], own["id"], own["unit"])
                found[key].append((record["when"], own["value"], own["u"]))
    return found


def effects(records):
    return [(record, effect) for record in records for effect in record["effects"]]


def most_frequent(rows):
    """Rows (machine code, what, machine) counted: the distinct machines and all, the most frequent first."""
    found = Counter(row[:2] for row in rows)
    ranked = sorted(found.items(), key=lambda item: (-item[1], item[0][1]))
    return [(*what, len({row[2] for row in rows if row[:2] == what}), count) for what, count in ranked]


def worst_machines(records):
    last = {record["machine_id"]: record for record in sorted(fitted(records), key=lambda record: record["when"])}
    rows = [(machine, record["when"], record["model"]["rms_um"]) for machine, record in last.items()]
    assert {"M0", "M1", "M2", "M3"} == set(last)
    return sorted(rows, key=lambda row: (-row[2], row[0]))


def fastest_drift(records):
    rows = []
    for (machine, id, unit), points in series(records).items():
        if len(points) < 4:
            continue
        years = np.array([when.timestamp() for when, _, _ in points]) / 31557600
        slope = np.polyfit(years - years.mean(), [value for _, value, _ in points], 1)[0]
        u = np.sqrt(np.mean([u**2 for _, _, u in points]) / np.sum((years - years.mean()) ** 2))
        rows.append((machine, id, slope, u, unit))
    rows.sort(key=lambda row: (-abs(row[2] / row[3]), row[0], row[1]))
    assert rows[0][:2] == ("M0", "EX0C")
    return rows[:10]


def frequent_effects(records):
    own = effects(records)
    meanings = {effect["id"]: effect["meaning"] for _, effect in own}
    found = most_frequent([(record["machine"]["code"], effect["id"], record["machine_id"]) for record, effect in own])
    assert [row[1:] for row in found] == [("EZC~C:h2", 1, MONTHS), ("EXC~C:h3", 1, 2)]
    return [(code, id, meanings[id], machines, count) for code, id, machines, count in found]


def frequent_sets(records):
    rows = [
        (record["machine"]["code"], tuple(sorted({effect["id"], *effect["aliases"]})), record["machine_id"])
        for record, effect in effects(records)
    ]
    found = most_frequent(rows)
    assert found[0][1] == ("EAC~C:precession-1", "EXC~C:precession-1", "EZ0A~C:h2", "EZC~C:h2")
    return [(code, list(names), machines, count) for code, names, machines, count in found]


def failures(records):
    failed = [record for record in records if record["error"]]
    files = defaultdict(list)
    for record in failed:
        files[record["error"]["stage"], record["error"]["message"]].append(record["file"])
    rows = [(stage, message, len(own), min(own)) for (stage, message), own in files.items()]
    assert Counter(stage for stage, *_ in rows) == {"read": 2, "validate": 2}
    return sorted(rows, key=lambda row: (-row[2], row[1]))


def sizes(records):
    own = defaultdict(list)
    for record in fitted(records):
        for parameter in record["model"]["parameters"]:
            own[parameter["id"], parameter["unit"]].append((parameter["value"], parameter["u"]))
    rows = []
    for (id, unit), pairs in own.items():
        values, u = zip(*pairs)
        rows.append((id, unit, len(values), median(values), stdev(values), max(map(abs, values)), median(u)))
    return sorted(rows)


def not_identifiable(records):
    own = defaultdict(list)
    for record in fitted(records):
        for parameter in record["model"]["parameters"]:
            own[parameter["id"]].append(False)
        for parameter in record["model"]["outcome"].get("not_estimated", []):
            own[parameter["id"]].append(True)
    rows = [(id, np.mean(flags), len(flags)) for id, flags in own.items()]
    rows.sort(key=lambda row: (-row[1], row[0]))
    assert rows[0] == ("EZ0C", 0.5, 4)
    return rows[:10]


def noise_by_month(records):
    own = sorted(fitted(records), key=lambda record: record["when"])
    rows = []
    for month, group in groupby(own, key=lambda record: record["when"].strftime("%Y-%m")):
        of_month = list(group)
        noise = median(record["model"]["noise_um"] for record in of_month)
        rows.append((month, len(of_month), noise, median(record["model"]["rms_um"] for record in of_month)))
    assert [row[1] for row in rows] == [1, 4, 4, 4, 4, 3, 3]
    return rows


def changes(records):
    # Thirteen months before the latest session.
    since = datetime(2023, 5, 20, 8)
    rows = []
    for (machine, id, unit), points in series(records).items():
        own = [point for point in points if point[0] >= since]
        for (_, before, u_before), (when, after, u_after) in zip(own, own[1:]):
            rows.append((machine, id, when, after - before, np.hypot(u_before, u_after), unit))
    rows.sort(key=lambda row: (-abs(row[3] / row[4]), row[0], row[1]))
    return rows[:10]


def correlations(records):
    latest = max(fitted(records), key=lambda record: record["when"])
    assert latest["machine_id"] == LATEST and latest["error"]["stage"] == "validate"
    ids = latest["model"]["covariance"]["ids"]
    lower = np.array(latest["model"]["covariance"]["matrix"])
    u = np.sqrt(np.diag(lower))
    rows = [(ids[a], ids[b], lower[b, a] / (u[a] * u[b])) for a, b in combinations(range(len(ids)), 2)]
    assert len(rows) >= 3
    return sorted(rows, key=lambda row: (-abs(row[2]), row[0], row[1]))[:10]


ANSWERS = {
    "Which machines are worst?": worst_machines,
    "Which parameters drift fastest?": fastest_drift,
    "Which effect is most frequent?": frequent_effects,
    "Which set of effects that the sessions cannot tell apart is most frequent?": frequent_sets,
    "Which sessions fail, and why?": failures,
    "How large is each parameter over all machines?": sizes,
    "Which parameters are often not identifiable?": not_identifiable,
    "How does the noise change from month to month?": noise_by_month,
    "What changed most from one session to the next in the last year?": changes,
    "Which parameters are correlated in a session?": correlations,
}


def test_each_of_the_ten_queries_has_an_answer_here():
    assert list(queries()) == list(ANSWERS) and len(ANSWERS) == 10


@pytest.mark.parametrize("question", ANSWERS)
def test_queries_of_the_guide(fleet, records, question):
    rows = abbe.fleet.write_dataset(fleet).sql(queries()[question]).fetchall()
    expected = ANSWERS[question](records)
    assert len(rows) == len(expected) >= 2
    for row, right in zip(rows, expected):
        for value, own in zip(row, right, strict=True):
            assert value == (pytest.approx(own, rel=1e-9) if isinstance(own, float) else own), (row, right)
