"""Measures the same tasks with other tools right after Abbe: the ratios of docs/development/speed.md. `ABBE_PROFILE=checked` selects another
build profile.

    pip install numpy scipy casadi jax
    python identify/benches/peers.py           as text
    python identify/benches/peers.py --json    for `benches/table.py`: by task the seconds of Abbe and of each tool

1. Value and eight derivatives of the tests of chapter 5, a million readings: NumPy with derivatives by hand, CasADi and JAX
   with their own derivatives and compilers.
2. A fit of a million readings, eight errors and 28 set-up parameters with priors: SciPy `least_squares` with an analytic Jacobian in NumPy;
   Gauss-Newton on CasADi's own compiled code. Abbe's figures come from `cargo bench`, run immediately before.

CasADi is compiled by gcc -O3 -march=native -fno-math-errno. Each figure is the minimum of a few rounds.
"""

import json
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import casadi as ca
import numpy as np
from scipy.optimize import least_squares

ROOT = Path(__file__).resolve().parents[2]
READINGS = 1_000_000
AS_JSON = "--json" in sys.argv
FLAGS = "-O3 -march=native -fno-math-errno -shared -fPIC".split()


def least(work, rounds=5):
    work()
    times = []
    for _ in range(rounds):
        start = time.perf_counter()
        work()
        times.append(time.perf_counter() - start)
    return min(times)


def abbe(bench, name):
    """Median duration of a benchmark by criterion, run now, in seconds."""
    profile = os.environ.get("ABBE_PROFILE", "bench")
    # All three packages, as in benches/table.py, so that cargo builds nothing anew.
    packages = [word for package in ("abbe-model", "abbe-identify", "abbe-codegen") for word in ("-p", package)]
    command = ["cargo", "bench", "-q", "--profile", profile, *packages, "--bench", bench, "--", "--warm-up-time", "1"]
    command.append("^" + name + "$")
    subprocess.run(command, cwd=ROOT, check=True, capture_output=True)
    folder = ROOT / "target" / "criterion" / name
    with open(folder / "new" / "estimates.json") as file:
        return json.load(file)["median"]["point_estimate"] * 1e-9


def length(m, q, errors, setup, point, spindle):
    """The bar reading in NumPy, JAX or CasADi; the module `m` has sin, cos, sqrt. The point passes through C and A, with small angles."""
    sin_c, cos_c, sin_a, cos_a = q
    ey, ez, ty, tz, fx, fy, gx, gy = errors
    px, py, pz = (p + s for p, s in zip(point, setup[:3]))
    x, y, z = cos_c * px - sin_c * py, sin_c * px + cos_c * py, pz
    x, y, z = x + gy * z + fx, y - gx * z + fy, z + gx * y - gy * x
    y, z = cos_a * y - sin_a * z, sin_a * y + cos_a * z
    x, y, z = x + ty * z - tz * y, y + tz * x + ey, z - ty * x + ez
    x, y, z = (a - b - s for a, b, s in zip((x, y, z), spindle, setup[3:6]))
    return m.sqrt(x * x + y * y + z * z) - setup[6]


def gradient(q, errors, setup, point, spindle):
    """Value and fifteen derivatives in NumPy, derived by hand, as for SciPy."""
    sin_c, cos_c, sin_a, cos_a = q
    ey, ez, ty, tz, fx, fy, gx, gy = errors
    px, py, pz = (p + s for p, s in zip(point, setup[:3]))
    x0, y0, z0 = cos_c * px - sin_c * py, sin_c * px + cos_c * py, pz
    x1, y1, z1 = x0 + gy * z0 + fx, y0 - gx * z0 + fy, z0 + gx * y0 - gy * x0
    y2, z2 = cos_a * y1 - sin_a * z1, sin_a * y1 + cos_a * z1
    x, y, z = x1 + ty * z2 - tz * y2, y2 + tz * x1 + ey, z2 - ty * x1 + ez
    x, y, z = (a - b - s for a, b, s in zip((x, y, z), spindle, setup[3:6]))
    distance = np.sqrt(x * x + y * y + z * z)
    ux, uy, uz = x / distance, y / distance, z / distance
    vx, vy, vz = ux + tz * uy - ty * uz, uy - tz * ux, uz + ty * ux
    wy, wz = cos_a * vy + sin_a * vz, cos_a * vz - sin_a * vy
    by_errors = [uy, uz, ux * z2 - uz * x1, uy * x1 - ux * y2, vx, wy, wz * y0 - wy * z0, vx * z0 - wz * x0]
    tx, t_y, t_z = vx - gy * wz, wy + gx * wz, wz + gy * vx - gx * wy
    by_ball = [cos_c * tx + sin_c * t_y, cos_c * t_y - sin_c * tx, t_z]
    return distance - setup[6], by_errors + by_ball + [-ux, -uy, -uz, -np.ones_like(ux)]


def derivatives():
    ours = abbe("chain", "value and eight derivatives, streaming/generic chain")
    angles = np.arange(READINGS) % 1000
    q = np.array([np.sin(angles * 0.006), np.cos(angles * 0.006), np.sin(angles * 0.0015), np.cos(angles * 0.0015)])
    errors = np.array([0.01, -0.02, 1e-4, 2e-4, 0.015, -0.01, -1e-4, 3e-4])
    none, point, spindle = np.zeros(7), np.array([0.0, 100.0, 15.0]), np.array([-111.803, 0.0, 0.0])
    found = {"NumPy, by hand": least(lambda: gradient(q, errors, none, point, spindle))}

    axes, small = ca.SX.sym("q", 4), ca.SX.sym("e", 8)
    value = length(ca, ca.vertsplit(axes), ca.vertsplit(small), none, point, spindle)
    one = ca.Function("one", [axes, small], [value, ca.gradient(value, small)])
    with tempfile.TemporaryDirectory() as folder:
        os.chdir(folder)
        one.generate("one.c")
        subprocess.run(["gcc", *FLAGS, "one.c", "-o", "one.so"], check=True)
        compiled = ca.external("one", "./one.so")
        mapped = compiled.map(READINGS, "serial")
        columns = ca.DM(q)
        small_columns = ca.DM(np.repeat(errors[:, None], READINGS, axis=1))
        found["CasADi, compiled, mapped"] = least(lambda: mapped(columns, small_columns), 3)

    import jax

    jax.config.update("jax_enable_x64", True)
    jnp = jax.numpy
    reading = lambda q, e: length(jnp, q, e, none, point, spindle)
    both = jax.jit(jax.vmap(jax.value_and_grad(reading, argnums=1), in_axes=(1, None)))
    device, device_errors = jnp.asarray(q), jnp.asarray(errors)
    found["JAX, jit(vmap(value_and_grad))"] = least(lambda: jax.block_until_ready(both(device, device_errors)))
    if AS_JSON:
        return {"value and eight derivatives of a million readings": (ours, found)}
    print(f"value and eight derivatives, {READINGS} readings, ns per reading (one thread unless the tool uses more)")
    print(f"  Abbe {ours / READINGS * 1e9:.1f}")
    for name, seconds in found.items():
        print(f"  {name} {seconds / READINGS * 1e9:.1f}: {seconds / ours:.1f} times Abbe's time")
    return {}


def fits():
    ours = abbe("fit", f"fit/{READINGS}")
    random = np.random.default_rng(1)
    count = READINGS // 4
    reach = np.sqrt(149.9946**2 - 100.0**2)
    point = np.array([0.0, 100.0, 0.0])
    tests = []
    truth = np.array([0.0353, -0.01, -5 * np.pi / 648000, 8 * np.pi / 648000, 0.012, -0.02, 0.0, 0.0])
    for axis, first, last, spindle, bar in [
        ("A", -20, 70, [0, 0, 0], 99.9881),
        ("A", -20, 70, [-reach, 0, 0], 149.9946),
        ("C", 0, 360, [0, 0, 0], 99.9881),
        ("C", 0, 360, [0, 0, reach], 149.9946),
    ]:
        angle = np.radians(np.linspace(first, last, count))
        zero, one = np.zeros(count), np.ones(count)
        turn = (np.sin(angle), np.cos(angle))
        q = (zero, one, *turn) if axis == "A" else (*turn, zero, one)
        setup = random.normal(size=7) * np.array([2, 2, 2, 1, 1, 1, 0.5]) * 1e-3
        observed = length(np, q, truth, setup, point, np.array(spindle)) + random.normal(size=count) * 3e-4
        tests.append((q, np.array(spindle, float), observed))
    prior = np.tile(np.array([2, 2, 2, 1, 1, 1, 0.5]) * 1e-3, 4)

    def residual(beta):
        rows = [
            (length(np, q, beta[:8], beta[8 + 7 * t : 15 + 7 * t], point, spindle) - observed) / 3e-4
            for t, (q, spindle, observed) in enumerate(tests)
        ]
        return np.concatenate([*rows, beta[8:] / prior])

    def jacobian(beta):
        matrix = np.zeros((READINGS + 28, 36))
        for t, (q, spindle, _) in enumerate(tests):
            _, columns = gradient(q, beta[:8], beta[8 + 7 * t : 15 + 7 * t], point, spindle)
            rows = slice(t * count, (t + 1) * count)
            for j, column in enumerate(columns):
                matrix[rows, j if j < 8 else 7 * t + j] = column / 3e-4
        matrix[READINGS:, 8:] = np.diag(1 / prior)
        return matrix

    scale = np.array([1, 1, 0.01, 0.01, 1, 1, 0.01, 0.01] + [1] * 28)
    results = {}
    for method in ["trf", "lm"]:
        start = time.perf_counter()
        fit = least_squares(residual, np.zeros(36), jac=jacobian, method=method, x_scale=scale)
        results[f"SciPy least_squares, {method}"] = (time.perf_counter() - start, fit.x, fit.nfev)

    # Gauss-Newton on CasADi's compiled Jacobian, mapped over the readings; the normal equations are NumPy's.
    axes, small, observed = ca.SX.sym("q", 4), ca.SX.sym("b", 15), ca.SX.sym("o")
    with tempfile.TemporaryDirectory() as folder:
        os.chdir(folder)
        compiled = []
        for t, (_, spindle, _) in enumerate(tests):
            value = length(ca, ca.vertsplit(axes), ca.vertsplit(small[:8]), ca.vertsplit(small[8:]), point, spindle)
            one = ca.Function(f"rows{t}", [axes, small, observed], [ca.gradient(value, small) / 3e-4, (observed - value) / 3e-4])
            one.generate(f"rows{t}.c")
            subprocess.run(["gcc", *FLAGS, f"rows{t}.c", "-o", f"rows{t}.so"], check=True)
            compiled.append(ca.external(f"rows{t}", f"./rows{t}.so").map(count, "serial"))
        inputs = [(ca.DM(np.array(q)), ca.DM(observed[None, :])) for q, _, observed in tests]

        def gauss_newton():
            beta = np.zeros(36)
            for iteration in range(20):
                normal, right = np.diag(np.concatenate([np.zeros(8), prior**-2.0])), np.concatenate([np.zeros(8), -beta[8:] / prior**2])
                for t, (q, observed) in enumerate(inputs):
                    own = np.r_[0:8, 8 + 7 * t : 15 + 7 * t]
                    rows, rest = compiled[t](q, ca.repmat(ca.DM(beta[own]), 1, count), observed)
                    rows, rest = rows.toarray(), rest.toarray().ravel()
                    normal[np.ix_(own, own)] += rows @ rows.T
                    right[own] += rows @ rest
                scaled = np.linalg.pinv(normal * np.outer(scale, scale), hermitian=True) @ (right * scale) * scale
                beta += scaled
                if np.abs(scaled / scale).max() < 1e-12:
                    break
            return beta, iteration + 1

        start = time.perf_counter()
        beta, iterations = gauss_newton()
        results["CasADi, compiled, Gauss-Newton"] = (time.perf_counter() - start, beta, iterations)
    if AS_JSON:
        return {"fit of a million readings, 36 parameters": (ours, {name: took for name, (took, _, _) in results.items()})}
    print(f"fit of {READINGS} readings, 8 errors and 28 set-up parameters, s (Abbe's with rank, outliers, held-out error and uncertainty)")
    print(f"  Abbe {ours:.2f}")
    for name, (seconds, x, count) in results.items():
        off = np.abs(x - results["SciPy least_squares, trf"][1]).max() * 1e3
        print(f"  {name} {seconds:.2f} ({count} evaluations, {off:.1e} µm from the first): {seconds / ours:.1f} times Abbe's time")
    return {}


if __name__ == "__main__":
    found = {**derivatives(), **fits()}
    if AS_JSON:
        print(json.dumps(found))
