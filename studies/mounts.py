"""How often `abbe trace` claims an effect on simulated mounts, and how often it names one that is there.

    python studies/mounts.py --sessions 400                    no effect beyond the set-up: false claims
    python studies/mounts.py --sessions 400 --arcsec 0.5       an azimuth axis that precesses by this angle

Each session has 54 stars and a noise of 0.5″ per coordinate. The mount is that of `tests/precession/simulate.py`, plain
matrices of NumPy. `--abbe FILE` is the command.
"""

import argparse
import json
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT / "tests" / "precession"))
from simulate import ARCSEC, errors, turn  # noqa: E402

STARS, NOISE = 54, 0.5 * ARCSEC


def stars(random, size):
    phase = random.uniform(0, 2 * np.pi)
    lines = ["az_deg,el_deg,true_azimuth_deg,true_elevation_deg"]
    for _ in range(STARS):
        az = random.uniform(0, 2 * np.pi)
        el = np.arcsin(random.uniform(np.sin(np.radians(20)), np.sin(np.radians(85))))
        tilt = [size * np.cos(2 * az - phase), size * np.sin(2 * az - phase), 0]
        constant, index = [-60 * ARCSEC, 35 * ARCSEC, -250 * ARCSEC], [0, 180 * ARCSEC, 0]
        sight = np.array([1, 80 * ARCSEC, 0])
        v = errors(constant) @ errors(tilt) @ turn((0, 0, -1), az) @ errors(index) @ turn((0, -1, 0), el) @ sight
        noise = random.normal(0, NOISE, 2)
        azimuth = np.arctan2(-v[1], v[0]) % (2 * np.pi) + noise[0] / np.cos(el)
        elevation = np.arctan2(v[2], np.hypot(v[0], v[1])) + noise[1]
        lines.append(",".join(f"{np.degrees(x):.9f}" for x in (az, el, azimuth, elevation)))
    return "\n".join(lines) + "\n"


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--abbe", type=Path, default=ROOT / "target" / "release" / "abbe", help="the command")
    parser.add_argument("--sessions", type=int, default=100)
    parser.add_argument("--arcsec", type=float, default=0.0, help="amount of the precession")
    options = parser.parse_args()
    claimed = named = 0
    with tempfile.TemporaryDirectory() as folder:
        folder = Path(folder)
        session = (ROOT / "tests" / "precession" / "mount.toml").read_text(encoding="utf-8")
        (folder / "mount.toml").write_text(session, encoding="utf-8")
        for number in range(options.sessions):
            data = stars(np.random.default_rng(1000 + number), options.arcsec * ARCSEC)
            (folder / "mount.csv").write_text(data, encoding="utf-8")
            command = [options.abbe.resolve(), "trace", "mount.toml", "--json", "trace.json", "--quiet", "--seed", str(number + 1)]
            subprocess.run(command, cwd=folder, check=True, capture_output=True)
            effects = json.loads((folder / "trace.json").read_text(encoding="utf-8"))["effects"]
            claimed += bool(effects)
            named += any((one["component"], one["shape"], one.get("order")) == ("EAAZ", "precession", -2) for one in effects)
    share = lambda count: f"{count} of {options.sessions} = {100 * count / options.sessions:.1f} %"
    print(f"an effect is claimed in {share(claimed)}, the precession is named in {share(named)}")


if __name__ == "__main__":
    main()
