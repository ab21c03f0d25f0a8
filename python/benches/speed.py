"""Speed and memory of the module: 10^6 readings of arrays, against the command and the kernel.

    python python/benches/speed.py [--json] ABBE [KERNEL]

ABBE is the command. KERNEL prints the times of the library on the same session:
`cargo bench --quiet --bench session --`. With `--json` the ratios are printed for `benches/table.py`.
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
    arguments = sys.argv[1:]
    as_json = "--json" in arguments
    command, *kernel = [word for word in arguments if word != "--json"]
    say = (lambda text: None) if as_json else print
    made, columns, added_mb = session()
    arrays_mb = sum(column.nbytes for column in columns.values()) / 2**20
    say(f"arrays {arrays_mb:.0f} MB, session {added_mb:.0f} MB: {added_mb / arrays_mb:.2f} times the arrays")
    before = peak_mb()
    made.fit()
    fit_mb = peak_mb() - before
    say(f"fit: {fit_mb:.0f} MB more at its peak")
    ratios = {"peak over arrays": (arrays_mb + added_mb + fit_mb) / arrays_mb}
    at = np.zeros(len(made.parameters))
    own = {
        "fit": mean_cpu_s(5, made.fit),
        "predict": mean_cpu_s(50, lambda: made.predict(at)),
        "jacobian": mean_cpu_s(20, lambda: made.jacobian(at)),
    }
    say(", ".join(f"{name} {seconds:.4f} s" for name, seconds in own.items()) + " of processor time")
    with tempfile.TemporaryDirectory() as folder:
        file = made.save(Path(folder) / "saved")
        line = [command, "fit", file, "--quiet", "--json", f"{folder}/fit.json"]
        whole = mean_cpu_s(1, lambda: subprocess.run(line, check=True, stdout=subprocess.DEVNULL))
        say(f"the command from files: {whole:.2f} s of processor time")
        if kernel:
            times = json.loads(subprocess.run([*kernel, file], check=True, capture_output=True, text=True).stdout)
            for name, seconds in own.items():
                ratios[name] = seconds / times[name]
                say(f"{name}: {seconds:.4f} s, in Rust {times[name]:.4f} s: {ratios[name]:.2f} times")
    if as_json:
        print(json.dumps(ratios))


if __name__ == "__main__":
    main()
