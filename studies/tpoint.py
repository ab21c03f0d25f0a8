"""The linear design of TPOINT, small angles, and least squares in it: independent of Abbe, and of any library.

Azimuth counts from north through east. Signs and terms are those of the table in docs/guide/pointing.md.
"""

import math
import re
import sys


def mod_file(path):
    """A printed fit of TPOINT: number of stars, sky rms, and the terms with a sigma: name, value, sigma, automatic."""
    lines = path.read_text(encoding="utf-8").splitlines()
    head = lines[1].split()
    terms = []
    for line in lines[2:]:
        words = line.lstrip("&= ").split()
        if len(words) == 3:
            terms.append((words[0], float(words[1]), float(words[2]), line.startswith("&")))
    return int(head[1]), float(head[2]), terms


def stars(path, without=()):
    """Azimuth and elevation of the encoders, and true minus encoder: azimuth times cos E, elevation; rad, rad, arcsec.
    `without` are lines of the file."""
    found = []
    for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), 1):
        words = line.split(";")[0].split()
        if number < 5 or len(words) < 4 or number in without:
            continue
        true_a, true_e, a, e = map(float, words[:4])
        off = (true_a - a + 180) % 360 - 180
        cos_e = math.cos(math.radians(e))
        found.append((math.radians(a), math.radians(e), off * cos_e * 3600, (true_e - e) * 3600))
    return found


def term_columns(name):
    """The column of a term of TPOINT at a star: azimuth times cos E, and elevation (Wallace, the conventions of TPOINT)."""
    south = lambda a: math.pi - a
    fixed = {
        "IA": lambda a, e: (-math.cos(e), 0.0),
        "IE": lambda a, e: (0.0, 1.0),
        "AN": lambda a, e: (-math.sin(a) * math.sin(e), -math.cos(a)),
        "AW": lambda a, e: (-math.cos(a) * math.sin(e), math.sin(a)),
        "CA": lambda a, e: (-1.0, 0.0),
        "NPAE": lambda a, e: (-math.sin(e), 0.0),
        "TF": lambda a, e: (0.0, -math.cos(e)),
        "TX": lambda a, e: (0.0, -math.cos(e) / math.sin(e)),
    }
    fixed["TX10"] = fixed["TX"]
    if name in fixed:
        return fixed[name]
    _, result, function, angle, order = re.fullmatch(r"(H)([AES])([SC])([AE])(\d?)", name).groups()
    number = int(order or 1)
    wave = math.sin if function == "S" else math.cos

    def column(a, e):
        value = wave(number * (south(a) if angle == "A" else e))
        return {"A": (-value * math.cos(e), 0.0), "S": (-value, 0.0), "E": (0.0, value)}[result]

    return column


def effect_columns(effect):
    """The columns of an effect of `trace` on a mount, small angles, by its component and shape; none for an effect that
    follows another driver than an axis."""
    of = {
        "EAAZ": lambda a, e: (math.cos(a) * math.sin(e), -math.sin(a)),
        "EBAZ": lambda a, e: (-math.sin(a) * math.sin(e), -math.cos(a)),
        "ECAZ": lambda a, e: (-math.cos(e), 0.0),
        "ECEL": lambda a, e: (-math.cos(e), 0.0),
        "EAEL": lambda a, e: (math.sin(e), 0.0),
        "EBEL": lambda a, e: (0.0, 1.0),
        "EB0EL": lambda a, e: (0.0, 1.0),
        "EA0EL": lambda a, e: (math.sin(e), 0.0),
    }
    component, order, driver = effect["component"], effect.get("order") or 1, effect["driver"]
    if driver not in ("AZ", "EL"):
        return []
    if component not in of:
        sys.exit(f"no columns are known of {component} over {driver}")
    angle = lambda a, e: abs(order) * (a if driver == "AZ" else e)
    times = lambda cell, value: (cell[0] * value, cell[1] * value)
    own = of[component]
    cosine = lambda a, e: times(own(a, e), math.cos(angle(a, e)))
    sine = lambda a, e: times(own(a, e), math.sin(angle(a, e)))
    if effect["shape"] == "cosine":
        return [cosine]
    if effect["shape"] == "cotangent":
        return [lambda a, e: times(own(a, e), 1 / math.tan(angle(a, e)))]
    if effect["shape"] == "harmonic":
        return [cosine, sine]
    if effect["shape"] == "polynomial":
        powers = range(1, order + 1)
        return [lambda a, e, power=power: times(own(a, e), (a if driver == "AZ" else e) ** power) for power in powers]
    # The error at right angles to the component, and the sign of the vector product of the axis and the component.
    partner = {"EAAZ": "EBAZ", "ECEL": "EAEL"}.get(component)
    if effect["shape"] == "precession" and partner:
        sign = math.copysign(1, -order)
        across = lambda a, e, value: times(of[partner](a, e), sign * value)
        add = lambda one, other: (one[0] + other[0], one[1] + other[1])
        return [
            lambda a, e: add(cosine(a, e), across(a, e, math.sin(angle(a, e)))),
            lambda a, e: add(sine(a, e), across(a, e, -math.cos(angle(a, e)))),
        ]
    sys.exit(f"no columns are known of {effect['shape']} of {component}")


def solve(rows, right):
    """Least squares by modified Gram–Schmidt with one reorthogonalisation."""
    count = len(rows[0])
    columns = [[row[k] for row in rows] for k in range(count)]
    r = [[0.0] * count for _ in range(count)]
    q = []
    for k, column in enumerate(columns):
        for _ in range(2):
            for i, other in enumerate(q):
                share = sum(a * b for a, b in zip(other, column))
                r[i][k] += share
                column = [b - share * a for a, b in zip(other, column)]
        r[k][k] = math.sqrt(sum(value * value for value in column))
        q.append([value / r[k][k] for value in column])
    found = [0.0] * count
    for k in reversed(range(count)):
        found[k] = (sum(a * b for a, b in zip(q[k], right)) - sum(r[k][j] * found[j] for j in range(k + 1, count))) / r[k][k]
    return found


def region(star):
    """Twelve regions of the sky: sixty degrees of azimuth, below and above 45° of elevation."""
    return (int(math.degrees(star[0]) % 360 // 60), star[1] > math.pi / 4)


def linear_residuals(fitted, judged, names, effects=()):
    """The residuals of some stars under a model of TPOINT terms and effects that linear least squares fits to others,
    arcsec."""
    terms = [*map(term_columns, names), *(column for effect in effects for column in effect_columns(effect))]
    rows, right = [], []
    for a, e, across, up in fitted:
        cells = [term(a, e) for term in terms]
        rows += [[cell[0] for cell in cells], [cell[1] for cell in cells]]
        right += [across, up]
    values = solve(rows, right)
    for a, e, across, up in judged:
        cells = [term(a, e) for term in terms]
        for k, observed in enumerate((across, up)):
            yield observed - sum(value * cell[k] for value, cell in zip(values, cells))


def linear_fit(data, names, effects=()):
    """The sum of squares of such a model in sample, and that of each left-out region of the sky, arcsec²."""
    held_out = []
    for left in sorted({region(star) for star in data}):
        inside = [star for star in data if region(star) == left]
        others = [star for star in data if region(star) != left]
        held_out.append(sum(value * value for value in linear_residuals(others, inside, names, effects)))
    return sum(value * value for value in linear_residuals(data, data, names, effects)), held_out


def sky_of(data, fitted):
    """Sky rms in sample and over left-out regions, from the sums of squares of `linear_fit`."""
    return [f"{math.sqrt(squares / len(data)):.2f}" for squares in (fitted[0], sum(fitted[1]))]


def rises(without, whole):
    """Whether the error over left-out regions rises without a term by more than the standard error of the rise, which
    follows from the scatter of the regions."""
    differences = [a - b for a, b in zip(without, whole)]
    count, total = len(differences), sum(differences)
    error = math.sqrt(sum((one - total / count) ** 2 for one in differences) * count / (count - 1))
    return total > error
