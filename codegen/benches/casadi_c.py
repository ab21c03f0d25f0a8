"""Benchmark of the printed C against that of CasADi: value and eight derivatives of the chapter 5 test, one reading at a time.

    pip install casadi
    python codegen/benches/casadi_c.py

Both files are compiled by gcc -O3 -march=native -fno-math-errno, linked into one program, checked against each other, and timed in turn;
the least of many rounds counts.
"""

import os
import subprocess
import tempfile
from pathlib import Path

import casadi as ca

HERE = Path(__file__).resolve().parent
FLAGS = ["-O3", "-march=native", "-fno-math-errno"]


def length(lengths, axes, errors):
    """Transforms the point through the chain with small-angle errors; arguments as in emitted.c."""
    d, r, h, z_ca = ca.vertsplit(lengths)
    sc, cc, sa, ca_ = ca.vertsplit(axes)
    ey, ez, ty, tz, fx, fy, gx, gy = ca.vertsplit(errors)
    x, y, z = -r * sc, r * cc, h - z_ca
    x, y, z = x + gy * z + fx, y - gx * z + fy, z + gx * y - gy * x
    y, z = ca_ * y - sa * z, sa * y + ca_ * z
    x, y, z = x + ty * z - tz * y, y + tz * x + ey, z - ty * x + ez
    x = x + d
    return ca.sqrt(x * x + y * y + z * z)


DRIVER = r"""
#include <math.h>
#include <stdio.h>
#include <time.h>
typedef long long int casadi_int;
int casadi_kernel(const double **arg, double **res, casadi_int *iw, double *w, int mem);
void bar_length_gradient(const double *lengths, const double *axes, const double *errors, double *value, double *gradient);
enum { N = 1000, ROUNDS = 4000 };
static double axes[N][4], work[1000];
static double now(void) { struct timespec t; clock_gettime(CLOCK_MONOTONIC, &t); return t.tv_sec + 1e-9 * t.tv_nsec; }
int main(void) {
    const double lengths[4] = {111.803, 100.0, 75.0, 60.0};
    const double errors[8] = {0.01, -0.02, 1e-4, 2e-4, 0.015, -0.01, -1e-4, 3e-4};
    double value, gradient[8], value_2, gradient_2[8], least = 1e9, least_2 = 1e9, worst = 0.0;
    const double *arg[3] = {lengths, 0, errors};
    double *res[2] = {&value_2, gradient_2};
    casadi_int iw[100];
    for (int i = 0; i < N; ++i) {
        axes[i][0] = sin(0.006 * i); axes[i][1] = cos(0.006 * i); axes[i][2] = sin(0.0015 * i); axes[i][3] = cos(0.0015 * i);
    }
    for (int round = 0; round < ROUNDS; ++round) {
        double start = now();
        for (int i = 0; i < N; ++i) bar_length_gradient(lengths, axes[i], errors, &value, gradient);
        double middle = now();
        for (int i = 0; i < N; ++i) { arg[1] = axes[i]; casadi_kernel(arg, res, iw, work, 0); }
        double end = now();
        if (middle - start < least) least = middle - start;
        if (end - middle < least_2) least_2 = end - middle;
    }
    worst = fabs(value - value_2) / value;
    for (int k = 0; k < 8; ++k) if (fabs(gradient[k] - gradient_2[k]) > worst) worst = fabs(gradient[k] - gradient_2[k]);
    if (worst > 1e-11) { printf("they differ by %g\n", worst); return 1; }
    printf("printed %.2f ns, CasADi %.2f ns, ratio %.3f\n", 1e9 * least / N, 1e9 * least_2 / N, least / least_2);
    return 0;
}
"""


def main():
    lengths, axes, errors = ca.SX.sym("l", 4), ca.SX.sym("a", 4), ca.SX.sym("e", 8)
    value = length(lengths, axes, errors)
    kernel = ca.Function("casadi_kernel", [lengths, axes, errors], [value, ca.gradient(value, errors)])
    with tempfile.TemporaryDirectory() as folder:
        start = os.getcwd()
        os.chdir(folder)
        kernel.generate("casadi_kernel.c")
        Path("driver.c").write_text(DRIVER)
        for source in ["casadi_kernel.c", "driver.c", str(HERE / "emitted.c")]:
            subprocess.run(["gcc", "-c", *FLAGS, source], check=True)
        subprocess.run(["gcc", "driver.o", "casadi_kernel.o", "emitted.o", "-lm", "-o", "run"], check=True)
        for _ in range(3):
            subprocess.run(["./run"], check=True)
        os.chdir(start)


if __name__ == "__main__":
    main()
