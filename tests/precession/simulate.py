"""Writes the readings of a mount and of an arm whose bearings precess, and what is in them.

    python tests/precession/simulate.py

The rotations are plain matrices of NumPy, without a line of Abbe: a motion with its errors is
Trans(o) · Trans(EX, EY, EZ) · Rx(EA) · Ry(EB) · Rz(EC) · Rot(d, q) · Trans(−o). `mount.csv` and `arm.csv` are what a session
reads, `answer.json` is what the tests compare with.
"""

import json
from pathlib import Path

import numpy as np

FOLDER = Path(__file__).resolve().parent
ARCSEC = np.pi / 648_000
random = np.random.default_rng(20260147)


def turn(axis, angle):
    """Rodrigues' formula."""
    x, y, z = axis
    k = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + np.sin(angle) * k + (1 - np.cos(angle)) * k @ k


def errors(angles):
    return turn((1, 0, 0), angles[0]) @ turn((0, 1, 0), angles[1]) @ turn((0, 0, 1), angles[2])


ANSWER = {
    "mount": {
        "noise_arcsec": 0.5,
        # The azimuth axis tilts by a constant angle. Its direction turns twice per turn against the azimuth, which runs
        # clockwise seen from above: EA = R cos(2 AZ − φ), and EB = R sin(2 AZ − φ), since the axis points down.
        "precession": {"amplitude_arcsec": 4.0, "phase_deg": 35.0, "order": 2, "backward": True},
        # The tube sags with the cosine of the elevation.
        "sag_arcsec": 9.0,
    },
    "arm": {
        "noise_um": 5.0,
        # The first joint moves on a circle that it runs through three times per turn, with the joint.
        "precession": {"amplitude_um": 40.0, "phase_deg": -70.0, "order": 3, "backward": False},
    },
}


def mount():
    truth = ANSWER["mount"]
    size = truth["precession"]["amplitude_arcsec"] * ARCSEC
    phase = np.radians(truth["precession"]["phase_deg"])
    lines = ["az_deg,el_deg,true_azimuth_deg,true_elevation_deg"]
    for _ in range(90):
        az = random.uniform(0, 2 * np.pi)
        el = np.arcsin(random.uniform(np.sin(np.radians(18)), np.sin(np.radians(86))))
        tilt = [size * np.cos(2 * az - phase), size * np.sin(2 * az - phase), 0]
        constant = [-60 * ARCSEC, 35 * ARCSEC, -250 * ARCSEC]
        # EL turns about −Y, so that a sag lowers the tube by a positive rotation about Y.
        sag = [0, 180 * ARCSEC + truth["sag_arcsec"] * ARCSEC * np.cos(el), 0]
        sight = np.array([1, 80 * ARCSEC, 0])
        v = errors(constant) @ errors(tilt) @ turn((0, 0, -1), az) @ errors(sag) @ turn((0, -1, 0), el) @ sight
        noise = random.normal(0, truth["noise_arcsec"] * ARCSEC, 2)
        azimuth = np.arctan2(-v[1], v[0]) % (2 * np.pi) + noise[0] / np.cos(el)
        elevation = np.arctan2(v[2], np.hypot(v[0], v[1])) + noise[1]
        lines.append(",".join(f"{np.degrees(x):.9f}" for x in (az, el, azimuth, elevation)))
    (FOLDER / "mount.csv").write_text("\n".join(lines) + "\n")


def arm():
    truth = ANSWER["arm"]
    size = truth["precession"]["amplitude_um"] * 1e-3
    phase = np.radians(truth["precession"]["phase_deg"])
    lines = ["J1_deg,J2_deg,J3_deg,px_mm,py_mm,pz_mm"]
    for _ in range(150):
        a, b, c = random.uniform([-3.1, -1.3, -1.4], [3.1, 1.3, 1.4])
        elbow = np.array([500, 0, 0]) + turn((0, 1, 0), c) @ np.array([400, 30, 0])
        shoulder = np.array([0, 0, 400]) + turn((0, 1, 0), b) @ elbow
        # J1 turns about +Z: EX leads, EY follows by a quarter of a cycle.
        shift = size * np.array([np.cos(3 * a - phase), np.sin(3 * a - phase), 0])
        point = shift + turn((0, 0, 1), a) @ shoulder + random.normal(0, truth["noise_um"] * 1e-3, 3)
        angles = [f"{np.degrees(q):.9f}" for q in (a, b, c)]
        lines.append(",".join(angles + [f"{x:.6f}" for x in point]))
    (FOLDER / "arm.csv").write_text("\n".join(lines) + "\n")


if __name__ == "__main__":
    mount()
    arm()
    (FOLDER / "answer.json").write_text(json.dumps(ANSWER, indent=2) + "\n")
