"""Times of the ten queries of `docs/guide/fleet.md` on a data set of 10⁶ parameter rows, made from random records.

    python python/benches/fleet_queries.py [FOLDER]
"""

import json
import random
import re
import sys
import tempfile
import time
from pathlib import Path
from unittest import mock

import abbe.fleet
from abbe.fleet import _dataset

MACHINES, MONTHS, PARAMETERS = 1389, 36, 20
GUIDE = Path(__file__).parent.parent.parent / "docs" / "guide" / "fleet.md"


def records():
    """Records of a fleet: a session a month of every machine."""
    draw = random.Random(1)
    names = [f"E{slot}0{axis}" for axis in "ABC" for slot in ("X", "Y", "Z", "A", "B", "C")][:PARAMETERS]
    names += [f"bar[T{k}]" for k in range(PARAMETERS - len(names))]
    packed = [1.0 if row == column else 0.2 for row in range(PARAMETERS) for column in range(row + 1)]
    for machine in range(MACHINES):
        level = [draw.gauss(0, 20) for _ in names]
        for month in range(MONTHS):
            key = f"{draw.getrandbits(256):064x}"
            parameters = [
                {"id": id, "value": value + draw.gauss(0, 1), "u": 1.0, "unit": "um", "meaning": id, "identifiable": True}
                for id, value in zip(names, level)
            ]
            effects = []
            if draw.random() < 0.3:
                order = draw.randint(1, 4)
                effects = [{
                    "id": f"EZC~C:h{order}", "component": "EZC", "driver": "C", "shape": "harmonic", "order": order,
                    "tests": [], "meaning": "axial motion", "family": "harmonics", "p_value": 0.005, "rms_gain_um": 1.0,
                    "unique": False, "aliases": [f"EAC~C:h{order - 1}"],
                }]  # fmt: skip
            record = {
                "key": key, "tool_version": "0", "seed": 1, "session_id": None, "machine_id": f"M{machine:04}",
                "machine": {"name": "M", "code": "w C A b Y X Z t", "sha256": "0"}, "about": {}, "inputs": [],
                "date": f"{2023 + month // 12}-{month % 12 + 1:02}-05", "error": None, "instrument": "ballbar",
                "readings": 400, "outliers": 0, "noise_um": 0.3, "noise_source": "stated", "verdict": "clean",
                "rms_before_um": 0.3, "rms_um": draw.gauss(0.3, 0.02), "heldout_rms_um": 0.3, "rank": PARAMETERS,
                "parameter_count": PARAMETERS, "conflicts": 0, "parameters": parameters, "covariance": packed,
                "effects": effects, "validation": None, "warnings": [],
            }  # fmt: skip
            file = f"/fleet/{machine}/{month}/session.toml"
            yield json.dumps({"file": file, "key": key, "session_id": file, "error": None}), json.dumps(record)


def main(folder: Path) -> None:
    start = time.perf_counter()
    with mock.patch.object(_dataset._abbe, "fleet_records", lambda out: (list(records()), [])):
        dataset = abbe.fleet.write_dataset(folder, folder)
    size = sum(file.stat().st_size for file in folder.rglob("*.parquet"))
    files = sum(1 for _ in folder.rglob("*.parquet"))
    print(f"{dataset.rows}, {files} files, {size / 1e6:.1f} MB, written in {time.perf_counter() - start:.0f} s")
    connection = _dataset.connect(folder)
    text = GUIDE.read_text(encoding="utf-8")
    for question, query in re.findall(r"\n\*\*(.+?)\*\*\n\n```sql\n(.*?)```", text, re.DOTALL):
        start = time.perf_counter()
        rows = connection.sql(query).fetchall()
        print(f"{time.perf_counter() - start:6.2f} s  {len(rows):4} rows  {question}")


if __name__ == "__main__":
    if len(sys.argv) > 1:
        main(Path(sys.argv[1]))
    else:
        with tempfile.TemporaryDirectory() as name:
            main(Path(name))
