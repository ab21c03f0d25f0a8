"""Poses of `abbe poses` beside those of FIGAROH's exchange (DetMax) on the same robot.

    pip install --no-deps figaroh==1.0.2
    python python/benches/poses.py

30 poses of the UR10 out of 1,000 in the box of `suite::plan::poses`, a tracker with 50 µm. Both sets are judged by the Jacobian
of :meth:`abbe.Session.jacobian` for the errors that the command estimates.
"""

from __future__ import annotations

import csv
import importlib.metadata
import json
import random
import subprocess
import sys
import tempfile
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np

import abbe

SESSION = Path(__file__).parents[2] / "sessions" / "ur10"
BOX_MM = [[-900, 900], [-900, 900], [100, 1300]]
POSES, CANDIDATES, NOISE_MM, TRAVEL_DEG = 30, 1000, 0.05, 360


def detmax() -> Any:
    """The class of FIGAROH without the imports of its module (Pinocchio, Picos): it needs a determinant only."""
    files = importlib.metadata.files("figaroh") or []
    module = next(file for file in files if file.name == "base_optimal_calibration.py")
    text = module.read_text()
    begin = text.index("class Detmax:")
    own = text[begin:].split("\n")[1:]
    end = next((k for k, line in enumerate(own) if line and not line.startswith((" ", "#"))), len(own))
    picos = ModuleType("picos")
    picos.DetRootN = lambda matrix: max(np.linalg.det(matrix), 0.0) ** (1 / len(matrix))  # type: ignore[attr-defined]
    sys.modules["picos"] = picos
    found: dict[str, Any] = {}
    exec("class Detmax:\n" + "\n".join(own[:end]), found)
    return found["Detmax"]


def session(poses_deg: np.ndarray) -> abbe.Session:
    """A session with these poses."""
    own = abbe.Session(abbe.Machine.read(SESSION / "machine.toml"), instrument="tracker", errors=["E?0J*"])
    axes = {f"j{k + 1}_deg": np.ascontiguousarray(poses_deg[:, k]) for k in range(6)}
    points = {f"p{axis}_mm": np.zeros(len(poses_deg)) for axis in "xyz"}
    own.add_test("A", target_mm=(-1184.4, -349.3, 12.2), target_u_um=float("inf"), **axes, **points)
    return own


def candidates(seed: int) -> np.ndarray:
    """Poses within the travel whose tool point lies in the box."""
    draw = np.random.default_rng(seed)
    found: list[np.ndarray] = []
    while len(found) < CANDIDATES:
        poses = draw.uniform(-TRAVEL_DEG, TRAVEL_DEG, (2000, 6))
        points = session(poses).predict().reshape(-1, 3)
        inside = [(low < points[:, k]) & (points[:, k] < high) for k, (low, high) in enumerate(BOX_MM)]
        found.extend(poses[np.all(inside, axis=0)])
    return np.array(found[:CANDIDATES])


def main() -> None:
    """Print the worst u and the geometric mean over the ellipsoid's axes, µm or ″, of each choice."""
    chosen = {}
    with tempfile.TemporaryDirectory() as folder:
        for criterion in ("worst", "d"):
            rows, result = Path(folder, f"{criterion}.csv"), Path(folder, f"{criterion}.json")
            box = ",".join(str(end) for ends in BOX_MM for end in ends)
            line = ["abbe", "poses", SESSION / "session.toml", "--poses", str(POSES), "--criterion", criterion, "--quiet"]
            line += ["--noise-um", str(1e3 * NOISE_MM), "--box-mm", box, "--out", rows, "--json", result]
            subprocess.run([str(word) for word in line], check=True)
            table = list(csv.reader(rows.read_text().splitlines()))[1:]
            chosen[f"abbe plan --criterion {criterion}"] = np.array(table, dtype=float)
            errors = [row["id"] for row in json.loads(result.read_text())["uncertainties"]]

    names = [parameter.id for parameter in session(np.zeros((2, 6))).parameters]
    columns = [k for k, name in enumerate(names) if name in errors or "[" in name]
    is_error = [k for k, column in enumerate(columns) if names[column] in errors]

    def rows_of(poses: np.ndarray) -> np.ndarray:
        return session(poses).jacobian()[:, columns].reshape(len(poses), 3, -1) / NOISE_MM

    def judged(blocks: np.ndarray) -> str:
        rows = blocks.reshape(-1, len(columns))
        covariance = np.linalg.inv(rows.T @ rows)[np.ix_(is_error, is_error)]
        volume = np.exp(np.linalg.slogdet(covariance)[1] / (2 * len(is_error)))
        return f"{np.sqrt(np.diag(covariance).max()):6.2f}  {volume:6.2f}"

    print("worst u, geometric mean")
    for name, poses in chosen.items():
        print(f"{judged(rows_of(poses))}  {name}")
    pool = rows_of(candidates(1))
    scale = 1 / np.sqrt((pool**2).sum((0, 1)))
    information = {k: (block * scale).T @ (block * scale) for k, block in enumerate(pool)}
    for seed in (1, 2, 3):
        random.seed(seed)
        kept: list[list[int]] = []
        sample = random.sample

        # The class keeps its poses to itself: the list that it exchanges in is the one that it draws.
        def drawn(of: Any, count: int, draw: Any = sample, kept: list[list[int]] = kept) -> list[int]:
            kept.append(draw(of, count))
            return kept[-1]

        random.sample = drawn  # type: ignore[assignment]
        try:
            detmax()(information, POSES).main_algo()
        finally:
            random.sample = sample  # type: ignore[assignment]
        print(f"{judged(pool[kept[0]])}  FIGAROH, Detmax, seed {seed}")


if __name__ == "__main__":
    main()
