"""Writes the foreign files of this folder and the readings that each of them holds (NAME.truth.csv).

The readings are computed here, from the Denavit-Hartenberg parameters of the UR10 and from the distance of two balls, and
written as instruments and robots write them. Nothing of Abbe is used. Run it in this folder: python3 generate.py
"""

import math
import random

random.seed(20)

# Standard Denavit-Hartenberg parameters of the UR10: a, d in mm, alpha in rad (Universal Robots, support article 45257).
UR10 = [
    (0.0, 127.3, math.pi / 2),
    (-612.0, 0.0, 0.0),
    (-572.3, 0.0, 0.0),
    (0.0, 163.941, math.pi / 2),
    (0.0, 115.7, -math.pi / 2),
    (0.0, 92.2, 0.0),
]
TARGET = (30.0, -20.0, 80.0)
NOISE_MM = 0.02


def product(a, b):
    return [[sum(a[i][k] * b[k][j] for k in range(4)) for j in range(4)] for i in range(4)]


def link(a, d, alpha, theta):
    ct, st, ca, sa = math.cos(theta), math.sin(theta), math.cos(alpha), math.sin(alpha)
    return [[ct, -st * ca, st * sa, a * ct], [st, ct * ca, -ct * sa, a * st], [0, sa, ca, d], [0, 0, 0, 1]]


def target_of(joints_rad):
    pose = [[float(i == j) for j in range(4)] for i in range(4)]
    for (a, d, alpha), theta in zip(UR10, joints_rad):
        pose = product(pose, link(a, d, alpha, theta))
    return [sum(pose[i][k] * (*TARGET, 1.0)[k] for k in range(4)) for i in range(3)]


def tracked(point):
    """In the frame of a tracker that stands 2.5 m away, turned by 130 degrees about Z and tilted by 2 degrees."""
    x, y, z = point
    c, s = math.cos(math.radians(130)), math.sin(math.radians(130))
    x, y = c * x - s * y, s * x + c * y
    t = math.radians(2)
    y, z = math.cos(t) * y - math.sin(t) * z, math.sin(t) * y + math.cos(t) * z
    return [x + 2500.0 + random.gauss(0, NOISE_MM), y + 400.0 + random.gauss(0, NOISE_MM), z - 900.0 + random.gauss(0, NOISE_MM)]


def poses(count=60):
    rows = []
    for _ in range(count):
        joints = [random.uniform(-2.9, 2.9) for _ in range(6)]
        rows.append((joints, tracked(target_of(joints))))
    return rows


def write(name, text, encoding="utf-8"):
    with open(name, "wb") as file:
        file.write(text.encode(encoding))


def truth(name, columns, rows):
    text = ",".join(columns) + "\n" + "".join(",".join(repr(float(x)) for x in row) + "\n" for row in rows)
    write(name.rsplit(".", 1)[0] + ".truth.csv", text)


JOINTS = [f"j{k}_deg" for k in range(1, 7)] + ["px_mm", "py_mm", "pz_mm"]


def robot_truth(name, rows):
    truth(name, JOINTS, [[math.degrees(q) for q in joints] + point for joints, point in rows])


def comma(value, digits):
    return f"{value:.{digits}f}".replace(".", ",")


def thousands(value, digits):
    return f"{value:,.{digits}f}".replace(",", "_").replace(".", ",").replace("_", ".")


def rounded(rows, joint=lambda q: q, point=lambda p: p):
    return [([joint(q) for q in joints], [point(p) for p in at]) for joints, at in rows]


def robots():
    # 1. Topics of ROS: radians, comma.
    rows = rounded(poses(), lambda q: round(q, 7), lambda p: round(p, 4))
    names = ["shoulder_pan_joint", "shoulder_lift_joint", "elbow_joint", "wrist_1_joint", "wrist_2_joint", "wrist_3_joint"]
    head = ",".join(["pose", *names, "measurement_x", "measurement_y", "measurement_z"])
    body = "".join(f"{k},{','.join(f'{q:.7f}' for q in j)},{','.join(f'{p:.4f}' for p in at)}\n" for k, (j, at) in enumerate(rows))
    write("ros.csv", head + "\n" + body)
    robot_truth("ros.csv", rows)

    # 2. German: semicolons, decimal comma, Latin-1, a protocol above.
    rows = [([math.radians(round(math.degrees(q), 4)) for q in j], [round(p, 3) for p in at]) for j, at in poses()]
    head = "Messprotokoll;Prüfer: Müller\nDatum;12.03.2024\n\nNr;" + ";".join(f"Achse {k} [°]" for k in range(1, 7)) + ";X [mm];Y [mm];Z [mm]\n"
    body = "".join(f"{k + 1};{';'.join(comma(math.degrees(q), 4) for q in j)};{';'.join(comma(p, 3) for p in at)}\r\n" for k, (j, at) in enumerate(rows))
    write("deutsch.csv", head + body, "latin-1")
    robot_truth("deutsch.csv", rows)

    # 3. Tabs, a line of names and a line of units.
    rows = [([math.radians(round(math.degrees(q), 5)) for q in j], [round(p, 4) for p in at]) for j, at in poses()]
    head = "\t".join([f"Joint{k}" for k in range(1, 7)] + ["X", "Y", "Z"]) + "\n" + "\t".join(["deg"] * 6 + ["mm"] * 3) + "\n"
    body = "".join("\t".join([f"{math.degrees(q):.5f}" for q in j] + [f"{p:.4f}" for p in at]) + "\n" for j, at in rows)
    write("units-line.txt", head + body)
    robot_truth("units-line.txt", rows)

    # 4. Nothing is said of units: radians and metres.
    rows = rounded(poses(), lambda q: round(q, 7), lambda p: round(p, 4))
    head = ",".join([f"q{k}" for k in range(6)] + ["x", "y", "z"]) + "\n"
    body = "".join(",".join([f"{q:.7f}" for q in j] + [f"{p / 1000:.7f}" for p in at]) + "\n" for j, at in rows)
    write("metres.csv", head + body)
    robot_truth("metres.csv", rows)

    # 5. A tracker's own readings: range and two angles, the second from the zenith.
    rows, body = [], ""
    for joints, (x, y, z) in poses():
        joints = [math.radians(round(math.degrees(q), 5)) for q in joints]
        distance = round(math.sqrt(x * x + y * y + z * z), 4)
        azimuth, zenith = round(math.degrees(math.atan2(y, x)), 6), round(math.degrees(math.atan2(math.hypot(x, y), z)), 6)
        a, v = math.radians(azimuth), math.radians(zenith)
        rows.append((joints, [distance * math.sin(v) * math.cos(a), distance * math.sin(v) * math.sin(a), distance * math.cos(v)]))
        body += ",".join([f"{math.degrees(q):.5f}" for q in joints] + [f"{distance:.4f}", f"{azimuth:.6f}", f"{zenith:.6f}"]) + "\n"
    write("polar-tracker.csv", ",".join([f"J{k} [deg]" for k in range(1, 7)] + ["Distance [mm]", "Azimuth [deg]", "Zenith [deg]"]) + "\n" + body)
    robot_truth("polar-tracker.csv", rows)

    # 6. UTF-16 with a byte order mark, as a spreadsheet program saves "Unicode text".
    rows = [([math.radians(round(math.degrees(q), 5)) for q in j], [round(p, 4) for p in at]) for j, at in poses()]
    head = "\t".join([f"J{k} (°)" for k in range(1, 7)] + ["SMR X (mm)", "SMR Y (mm)", "SMR Z (mm)"]) + "\r\n"
    body = "".join("\t".join([f"{math.degrees(q):.5f}" for q in j] + [f"{p:.4f}" for p in at]) + "\r\n" for j, at in rows)
    write("unicode.txt", "\ufeff" + head + body, "utf-16-le")
    robot_truth("unicode.txt", rows)

    # 7. Inches.
    rows = [([math.radians(round(math.degrees(q), 4)) for q in j], [round(p / 25.4, 5) * 25.4 for p in at]) for j, at in poses()]
    head = "|".join([f"axis {k} deg" for k in range(1, 7)] + ["meas X in", "meas Y in", "meas Z in"]) + "\n"
    body = "".join("|".join([f"{math.degrees(q):.4f}" for q in j] + [f"{p / 25.4:.5f}" for p in at]) + "\n" for j, at in rows)
    write("inch.csv", head + body)
    robot_truth("inch.csv", rows)

    # 8. Columns of a numerical program, aligned by spaces, names in a comment.
    rows = rounded(poses(), lambda q: round(q, 6), lambda p: round(p, 3))
    head = "% " + "  ".join([f"theta{k}" for k in range(1, 7)] + ["px", "py", "pz"]) + "\n"
    body = "".join("  ".join([f"{q:12.6f}" for q in j] + [f"{p:12.3f}" for p in at]) + "\n" for j, at in rows)
    write("spaces.dat", head + body)
    robot_truth("spaces.dat", rows)

    # 9. Quoted cells, a date and time, a temperature in degrees Fahrenheit.
    rows = [([math.radians(round(math.degrees(q), 4)) for q in j], [round(p, 3) for p in at]) for j, at in poses()]
    head = '"Timestamp","' + '","'.join([f"J{k} (deg)" for k in range(1, 7)] + ["X (mm)", "Y (mm)", "Z (mm)", "Temperature (°F)"]) + '"\n'
    body, table = "", []
    for k, (j, at) in enumerate(rows):
        seconds = 3600 * 23 + 58 * 60 + 30 + 7 * k
        day, rest = divmod(seconds, 86400)
        stamp = f"2024-02-{29 if day == 0 else 1:02d}" if day == 0 else "2024-03-01"
        fahrenheit = round(68 + 0.01 * k, 2)
        stamp += f"T{rest // 3600:02d}:{rest % 3600 // 60:02d}:{rest % 60:02d}"
        body += ",".join([f'"{stamp}"'] + [f"{math.degrees(q):.4f}" for q in j] + [f"{p:.3f}" for p in at] + [f"{fahrenheit}"]) + "\n"
        table.append([7.0 * k] + [math.degrees(q) for q in j] + at + [(fahrenheit - 32) * 5 / 9])
    write("clock.csv", head + body)
    truth("clock.csv", ["time_s", *JOINTS, "temperature_c"], table)

    # 10. Commanded and actual positions: the actual ones are read.
    rows = [([math.radians(round(math.degrees(q), 4)) for q in j], [round(p, 3) for p in at]) for j, at in poses()]
    head = ";".join([f"joint_{k}_{what} [deg]" for k in range(1, 7) for what in ("cmd", "act")] + ["X [mm]", "Y [mm]", "Z [mm]"]) + "\n"
    body = ""
    for j, at in rows:
        pairs = [f"{math.degrees(q) + random.gauss(0, 0.5):.4f};{math.degrees(q):.4f}" for q in j]
        body += ";".join(pairs + [f"{p:.3f}" for p in at]) + "\n"
    write("command-actual.csv", head + body)
    robot_truth("command-actual.csv", rows)

    # 11. Thousands are grouped.
    rows = [([math.radians(round(math.degrees(q), 3)) for q in j], [round(p, 3) for p in at]) for j, at in poses()]
    head = ";".join([f"A{k} [°]" for k in range(1, 7)] + ["X [mm]", "Y [mm]", "Z [mm]"]) + "\n"
    body = "".join(";".join([comma(math.degrees(q), 3) for q in j] + [thousands(p, 3) for p in at]) + "\n" for j, at in rows)
    write("grouped.csv", head + body)
    robot_truth("grouped.csv", rows)

    # 12. Refused: no names at all.
    rows = poses()
    write("no-names.csv", "".join(",".join([f"{q:.6f}" for q in j] + [f"{p:.3f}" for p in at]) + "\n" for j, at in rows))


def ball_bars():
    bar = 99.9881

    def reading(c_deg, backward=False):
        c = math.radians(c_deg)
        return bar + 0.012 * math.sin(c) - 0.004 * math.cos(c) + (0.002 if backward else 0.0) + random.gauss(0, 0.0002)

    angles = [float(k) for k in range(0, 361, 5)]

    # 13. German ball bar: semicolons, decimal comma, two lines of titles.
    rows = [(c, round(reading(c), 4)) for c in angles]
    body = "".join(f"{k + 1};{comma(c, 1)};{comma(length, 4)}\n" for k, (c, length) in enumerate(rows))
    write("kugelstab.csv", "Kugelstab QC20;;\nMaschine 4711;;\nNr.;Drehwinkel C [°];Länge [mm]\n" + body)
    truth("kugelstab.csv", ["c_deg", "length_mm"], rows)

    # 14. Forward and backward in two columns.
    pairs = [(c, round((reading(c) - bar) * 1e3, 2), round((reading(c, True) - bar) * 1e3, 2)) for c in angles]
    body = "".join(f"{c:.1f},{forward:.2f},{backward:.2f}\n" for c, forward, backward in pairs)
    write("two-directions.csv", "C (deg),Deviation forward (µm),Deviation backward (µm)\n" + body)
    rows = [(1, c, bar + forward * 1e-3) for c, forward, _ in pairs] + [(2, c, bar + backward * 1e-3) for c, _, backward in reversed(pairs)]
    truth("two-directions.csv", ["run", "c_deg", "length_mm"], rows)

    # 15. A circle in X and Y: the polar angle in place of positions, both directions, tabs.
    table = [(a, round(1.5 * math.cos(math.radians(a)) + 3.0 * math.sin(2 * math.radians(a)), 2)) for a in angles]
    body = "".join(f"{a:.1f}\t{d:.2f}\t{d + 0.4:.2f}\n" for a, d in table)
    write("polar.txt", "Winkel\tAbweichung\tAbweichung\n\tvor\tzurück\n[°]\t[µm]\t[µm]\n" + body)
    at = lambda a: (100.0 * math.cos(math.radians(a)), 100.0 * math.sin(math.radians(a)))
    rows = [(1, *at(a), 100.0 + d * 1e-3) for a, d in table] + [(2, *at(a), 100.0 + (d + 0.4) * 1e-3) for a, d in reversed(table)]
    truth("polar.txt", ["run", "x_mm", "y_mm", "length_mm"], rows)

    # 16. Rows without a reading, and a mean below the last row.
    rows, body = [], ""
    for k, c in enumerate(angles):
        length = round(reading(c), 4)
        if k in (7, 31):
            body += f"{c:.1f};-----\n"
        else:
            body += f"{c:.1f};{length:.4f}\n"
            rows.append((c, length))
    write("gaps.csv", "C_deg;Length_mm\n" + body + f"\nMean;{sum(x for _, x in rows) / len(rows):.4f}\nEnd of report\n")
    truth("gaps.csv", ["c_deg", "length_mm"], rows)

    # 17. Refused: a comma for decimals and between columns.
    body = "".join(f"{comma(c + 0.5, 1)},{comma(reading(c), 4)}\n" for c in angles)
    write("comma-twice.csv", "C [deg],Length [mm]\n" + body)


def others():
    # 18. R-test: axes in a group of names over single letters, units below.
    rows, body = [], ""
    for c in range(0, 361, 10):
        a = math.radians(c)
        x, y = 100.0 * math.cos(a), 100.0 * math.sin(a)
        e = [round(4.0 * math.sin(a), 2), round(-3.0 * math.cos(a), 2), round(1.0 + math.cos(2 * a), 2)]
        body += f"{c};{x:.6f};{y:.6f};60;{e[0]:.2f};{e[1]:.2f};{e[2]:.2f}\n"
        rows.append((c, round(x, 6), round(y, 6), 60.0, *e))
    write("r-test.csv", "Axis;;;;Deviation;;\nC;X;Y;Z;dX;dY;dZ\n°;mm;mm;mm;µm;µm;µm\n" + body)
    truth("r-test.csv", ["c_deg", "x_mm", "y_mm", "z_mm", "dx_um", "dy_um", "dz_um"], rows)

    # 19. Laser along X: two runs in both directions, four columns of readings.
    table = []
    for k in range(21):
        x = -200.0 + 20.0 * k
        first = round(0.02 * x + 0.5 * math.sin(x / 40), 2)
        table.append((x, first, first + 0.8))
    body = "".join(f"{x:.3f}\t{a:.2f}\t{b:.2f}\n" for x, a, b in table)
    write("laser.txt", "# Laser interferometer\nTarget position X (mm)\tError + (µm)\tError - (µm)\n" + body)
    rows = [(1, x, a) for x, a, _ in table] + [(2, x, b) for x, _, b in reversed(table)]
    truth("laser.txt", ["run", "x_mm", "deviation_um"], rows)

    # 20. A robot's ball in a socket: only joints, German, radians.
    rows = [[round(random.uniform(-2.5, 2.5), 6) for _ in range(6)] for _ in range(40)]
    body = "".join(";".join([comma(q, 6) for q in row] + [str(k % 3)]) + "\n" for k, row in enumerate(rows))
    write("sockets.csv", ";".join([f"Gelenk {k} [rad]" for k in range(1, 7)] + ["Socket"]) + "\n" + body)
    truth("sockets.csv", [f"j{k}_deg" for k in range(1, 7)], [[math.degrees(q) for q in row] for row in rows])


robots()
ball_bars()
others()
