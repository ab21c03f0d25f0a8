"""What the tests of fleets share: simulated sessions of some machines, and the guide."""

import math
import re
from pathlib import Path

from conftest import SESSIONS

import abbe

GUIDE = Path(__file__).parent.parent.parent / "docs" / "guide" / "fleet.md"


def ball_bar(about, errors=("EX0C", "EY0C"), z_mm=75, noise_um=0.3):
    """The plan of a circle of C."""
    machine = abbe.Session.read(SESSIONS / "hermle-c600u" / "chapter5.toml").machine
    session = abbe.Session(machine, noise_um=noise_um, errors=list(errors), about=about)
    bar_mm = math.hypot(100, z_mm)
    session.add_test(
        "C125", bar_mm=bar_mm, workpiece_ball_mm=(0, 100, 0), spindle_ball_mm=(0, 0, 0), z_mm=z_mm,
        sweep={"axis": "C", "from_deg": 0, "to_deg": 360, "step_deg": 4},
    )  # fmt: skip
    return session


def make(folder, count, machines=4):
    """Small simulated sessions of some machines, one a month. The first machine drifts."""
    for number in range(count):
        machine, month = number % machines, number // machines
        date = f"{2024 + month // 12}-{month % 12 + 1:02}-05T08:00:00"
        drift = 0.4 * month if machine == 0 else 0.0
        plan = ball_bar({"serial_number": f"M{machine}", "date": date})
        measured = plan.simulate({"EX0C": 10.0 + drift, "EY0C": -5.0}, seed=number + 1)
        (folder / f"m{machine}").mkdir(parents=True, exist_ok=True)
        measured.save(folder / f"m{machine}" / f"{month:02}")
    return folder


def results(out):
    """The results of a folder by the names of their files."""
    return {file.name: file.read_bytes() for file in sorted((Path(out) / "results").rglob("*.json"))}


def recipe(heading, language):
    """The only block of a language below a heading of the guide."""
    text = GUIDE.read_text(encoding="utf-8")
    (section,) = re.findall(rf"\n#+ {heading}\n(.*?)(?=\n#+ )", text, re.DOTALL)
    (block,) = re.findall(rf"```{language}\n(.*?)```", section, re.DOTALL)
    return block


def queries():
    """The queries of the guide by the question in front of each."""
    text = GUIDE.read_text(encoding="utf-8")
    return dict(re.findall(r"\n\*\*(.+?)\*\*\n\n```sql\n(.*?)```", text, re.DOTALL))
