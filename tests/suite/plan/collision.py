"""Least clearance of planned tests by MuJoCo: argument is a folder of sessions, output is JSON by file name.

The kinematics, the shapes and the sampling are of this script; nothing of the project is used.
"""

import json
import math
import pathlib
import sys
import tomllib

import mujoco
import numpy as np

FINER = 3


def capsule(name, a, b, radius):
    """A capsule from a to b, at least a sphere."""
    a, b = np.array(a, float), np.array(b, float)
    if np.linalg.norm(b - a) < 1e-6:
        b = a + [0, 0, 1e-6]
    ends = " ".join(f"{x!r}" for x in [*a.tolist(), *b.tolist()])
    return f'<geom name="{name}" type="capsule" fromto="{ends}" size="{radius!r}"/>'


def beyond(a, b, by):
    length = math.dist(a, b)
    return np.array(b if length <= by else [x + (y - x) * (by / length) for x, y in zip(a, b)], float)


def corners(path):
    """The corners of a binary or an ASCII STL file."""
    contents = path.read_bytes()
    if contents.startswith(b"solid"):
        words = contents.decode().split("vertex")[1:]
        return np.array([[float(x) for x in word.split()[:3]] for word in words])
    count = int.from_bytes(contents[80:84], "little")
    facets = np.frombuffer(contents[84:], np.dtype([("floats", "<f4", 12), ("rest", "<u2")]), count)
    return facets["floats"][:, 3:].reshape(-1, 3).astype(float)


def geom(body):
    if "stl" in body:
        # The hull of the corners: these surfaces are convex.
        return f'<geom name="{body["name"]}" type="mesh" mesh="{body["name"]}"/>'
    if "box_mm" in body:
        low, high = (np.array(corner, float) for corner in body["box_mm"])
        centre, half = (low + high) / 2, (high - low) / 2
        text = lambda v: " ".join(f"{x!r}" for x in v.tolist())
        return f'<geom name="{body["name"]}" type="box" pos="{text(centre)}" size="{text(half)}"/>'
    own = body["capsule"]
    return capsule(body["name"], own["from_mm"], own["to_mm"], own["radius_mm"])


def scene(session, folder):
    """The model and the side of each geom."""
    machine, test, sizes = session["machine"], session["test"][0], session["clearance"]
    workpiece, tool = ("".join(machine["chain"].split())[1:-1]).split("b")
    meshes = ""
    side, geoms = {}, {name: "" for name in [*workpiece, *tool, ""]}
    for body in machine["body"]:
        axis = body.get("axis", "")
        geoms[axis] += geom(body)
        if "stl" in body:
            points = np.unique(corners(folder / body["stl"]), axis=0)
            text = " ".join(f"{x!r}" for x in points.ravel().tolist())
            meshes += f'<mesh name="{body["name"]}" vertex="{text}"/>'
        side[body["name"]] = "w" if axis and axis in workpiece else "t" if axis else "b"
    ball, spindle = test["workpiece_ball_mm"], test["spindle_ball_mm"]
    bar = sizes["bar_radius_mm"]
    for name, own, at, up, axis in [
        ("workpiece holder", sizes["workpiece_holder"], ball, -1, workpiece[0]),
        ("spindle holder", sizes["spindle_holder"], spindle, 1, tool[-1]),
    ]:
        end = np.array(at, float) + [0, 0, up * own["length_mm"]]
        geoms[axis] += capsule(name, at, end, own["radius_mm"])
        geoms[axis] += capsule(name + " beyond", beyond(at, end, 2 * (bar + own["radius_mm"])), end, own["radius_mm"])
        side[name] = "w" if up < 0 else "t"
    sites = {workpiece[0]: f'<site name="ball" pos="{ball[0]} {ball[1]} {ball[2]}"/>',
             tool[-1]: f'<site name="spindle" pos="{spindle[0]} {spindle[1]} {spindle[2]}"/>'}

    def nested(order):
        text = ""
        for axis in reversed(order):
            kind = "hinge" if axis in "ABC" else "slide"
            direction = {"A": "1 0 0", "B": "0 1 0", "C": "0 0 1", "X": "1 0 0", "Y": "0 1 0", "Z": "0 0 1"}[axis]
            inertial = '<inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/>'
            joint = f'<joint name="{axis}" type="{kind}" axis="{direction}"/>'
            text = f'<body name="body {axis}">{inertial}{joint}{geoms[axis]}{sites.get(axis, "")}{text}</body>'
        return text

    moving = "".join(
        f'<body name="{name}" mocap="true"><geom name="{name}" type="capsule" size="{bar!r} 1"/></body>'
        for name in ["bar", "bar beyond workpiece", "bar beyond spindle"]
    )
    # From the bed outwards on either side.
    text = f"""<mujoco><compiler angle="radian"/><asset>{meshes}</asset><worldbody>{geoms[""]}{nested(workpiece[::-1])}{nested(tool)}{moving}
      </worldbody></mujoco>"""
    return mujoco.MjModel.from_xml_string(text), side


class Bar:
    """A bar that is put between two points."""

    def __init__(self, model, data, name):
        self.model, self.data = model, data
        body, self.geom = (mujoco.mj_name2id(model, kind, name) for kind in (mujoco.mjtObj.mjOBJ_BODY, mujoco.mjtObj.mjOBJ_GEOM))
        self.mocap = model.body_mocapid[body]
        self.quat = np.zeros(4)

    def place(self, a, b):
        half = max(math.dist(a, b) / 2, 1e-6)
        self.model.geom_size[self.geom, 1] = half
        self.model.geom_rbound[self.geom] = half + self.model.geom_size[self.geom, 0]
        mujoco.mju_quatZ2Vec(self.quat, (b - a) / (2 * half) if half > 1e-6 else np.array([0.0, 0.0, 1.0]))
        self.data.mocap_pos[self.mocap], self.data.mocap_quat[self.mocap] = (a + b) / 2, self.quat


def least(file):
    session = tomllib.loads(file.read_text())
    test, sizes = session["test"][0], session["clearance"]
    model, side = scene(session, file.parent)
    data = mujoco.MjData(model)
    joint = lambda axis: model.jnt_qposadr[mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_JOINT, axis)]
    for key, value in test.get("at", {}).items():
        axis, unit = key.split("_")
        data.qpos[joint(axis.upper())] = math.radians(value) if unit == "deg" else value
    sweep = test["sweep"]
    steps = round((sweep["to_deg"] - sweep["from_deg"]) / sweep["step_deg"]) * FINER
    pairs = []
    names = list(side)
    for i, one in enumerate(names):
        pairs += [(one, other) for other in names[i + 1:] if side[one] != side[other]]
        if one == "workpiece holder":
            pairs.append(("bar beyond workpiece", "workpiece holder beyond"))
        elif one == "spindle holder":
            pairs.append(("bar beyond spindle", "spindle holder beyond"))
        else:
            pairs.append(("bar", one))
    ids = np.array([[mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_GEOM, name) for name in pair] for pair in pairs])
    skip = {name: 2 * (sizes["bar_radius_mm"] + sizes[name + "_holder"]["radius_mm"]) for name in ("workpiece", "spindle")}
    bars = [Bar(model, data, name) for name in ("bar", "bar beyond workpiece", "bar beyond spindle")]
    ball, spindle, swept = data.site("ball"), data.site("spindle"), joint(sweep["axis"])
    found = math.inf
    for degrees in np.linspace(sweep["from_deg"], sweep["to_deg"], steps + 1):
        data.qpos[swept] = math.radians(degrees)
        mujoco.mj_kinematics(model, data)
        a, b = ball.xpos.copy(), spindle.xpos.copy()
        bars[0].place(a, b)
        bars[1].place(beyond(a, b, skip["workpiece"]), b)
        bars[2].place(beyond(b, a, skip["spindle"]), a)
        mujoco.mj_kinematics(model, data)
        # Spheres about the shapes exclude most pairs.
        between = data.geom_xpos[ids[:, 0]] - data.geom_xpos[ids[:, 1]]
        apart = np.sqrt(np.einsum("ij,ij->i", between, between))
        for one, other in ids[apart - model.geom_rbound[ids].sum(axis=1) < found].tolist():
            found = min(found, mujoco.mj_geomDistance(model, data, one, other, 1e4, None))
    return found


print(json.dumps({file.name: least(file) for file in sorted(pathlib.Path(sys.argv[1]).glob("*.toml"))}))
