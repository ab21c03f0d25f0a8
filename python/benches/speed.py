"""Speed and memory of the module: 10^6 readings of arrays, against the command and the kernel.

    python python/benches/speed.py ABBE [KERNEL]

ABBE is the command. KERNEL prints the times of the library on the same session:
`cargo bench --quiet --bench session --`.
"""

import json
import os
import resource
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np

import abbe

ROWS = 1_000_000


def session() -> tuple[abbe.Session, dict[str, np.ndarray], float]:
    """The session, its arrays, and the increase of the peak of memory by it, MB."""
    random = np.random.default_rng(1)
    runs = np.repeat(np.arange(20), ROWS // 20)
    c = np.tile(np.linspace(0.0, 360.0, ROWS // 20), 20)
    sine, cosine = np.sin(np.radians(c)), np.cos(np.radians(c))
    length = np.sqrt((0.012 - 100 * sine) ** 2 + (100 * cosine - 0.005) ** 2 + 111.803**2)
    columns = {
        "run": runs.astype(float),
        "time_s": np.arange(ROWS) * 0.01,
        "c_deg": c,
        **{name: np.zeros(ROWS) for name in ("x_mm", "y_mm")},
        "a_deg": np.zeros(ROWS),
        "z_mm": np.full(ROWS, 111.803),
        "length_mm": length + random.normal(0, 0.3e-3, ROWS),
    }
    before = peak_mb()
    made = abbe.Session(abbe.Machine.from_code("w C A b Y X Z t"), noise_um=0.3)
    made.add_test(
        "C150", **columns, bar_mm=150.0, workpiece_ball_mm=(0, 100, 0), spindle_ball_mm=(0, 0, 0),
        bar_u_um=0.5, workpiece_ball_u_um=(2, 2, 2), spindle_ball_u_um=(1, 1, 1),
    )
    return made, columns, peak_mb() - before


def peak_mb() -> float:
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024


def cpu_s() -> float:
    """Processor time of this process and of those that it has waited for: other work on the machine does not count."""
    times = os.times()
    return times.user + times.system + times.children_user + times.children_system


def mean_cpu_s(repeats: int, work) -> float:
    start = cpu_s()
    for _ in range(repeats):
        work()
    return (cpu_s() - start) / repeats


def main() -> None:
    command, *kernel = sys.argv[1:]
    made, columns, added_mb = session()
    arrays_mb = sum(column.nbytes for column in columns.values()) / 2**20
    print(f"arrays {arrays_mb:.0f} MB, session {added_mb:.0f} MB: {added_mb / arrays_mb:.2f} times the arrays")
    before = peak_mb()
    made.fit()
    print(f"fit: {peak_mb() - before:.0f} MB more at its peak")
    fit_s = mean_cpu_s(5, made.fit)
    at = np.zeros(len(made.parameters))
    predict_s = mean_cpu_s(50, lambda: made.predict(at))
    jacobian_s = mean_cpu_s(20, lambda: made.jacobian(at))
    print(f"fit {fit_s:.3f} s, predict {predict_s:.4f} s, jacobian {jacobian_s:.4f} s of processor time")
    with tempfile.TemporaryDirectory() as folder:
        file = made.save(Path(folder) / "saved")
        line = [command, "fit", file, "--quiet", "--json", f"{folder}/fit.json"]
        whole = mean_cpu_s(1, lambda: subprocess.run(line, check=True))
        print(f"the command from files: {whole:.2f} s of processor time")
        if kernel:
            times = json.loads(subprocess.run([*kernel, file], check=True, capture_output=True, text=True).stdout)
            for name, own in [("fit", fit_s), ("predict", predict_s), ("jacobian", jacobian_s)]:
                print(f"{name}: {own:.4f} s, in Rust {times[name]:.4f} s: {own / times[name]:.2f} times")


if __name__ == "__main__":
    main()
