"""Writes the URDF files of this folder from the origins, axes and limits that the makers and their ROS packages publish.

Sources: ur_description (UR5e, UR10), franka_description (Panda), iiwa_stack (iiwa 14), abb_irb120_support (IRB 120); the
SCARA has the dimensions of the ABB IRB 910SC-3/0.55. Nothing of Abbe is used. Run it in this folder: python3 generate.py
"""

PI2 = 1.5707963267948966
PI = 3.141592653589793


def urdf(name, joints, tip):
    """Joints: name, type, xyz, rpy, axis, lower, upper."""
    text = f'<?xml version="1.0"?>\n<!-- {name}: joints only; masses are placeholders. -->\n<robot name="{name}">\n'
    links = ["base_link"] + [f"link_{k + 1}" for k in range(len(joints) - 1)] + [tip]
    for link in links:
        text += f'  <link name="{link}">\n    <inertial><mass value="1"/><inertia ixx="0.01" ixy="0" ixz="0" iyy="0.01" iyz="0" izz="0.01"/></inertial>\n  </link>\n'
    for k, (joint, kind, xyz, rpy, axis, limits) in enumerate(joints):
        text += f'  <joint name="{joint}" type="{kind}">\n    <parent link="{links[k]}"/>\n    <child link="{links[k + 1]}"/>\n'
        origin = f'xyz="{xyz}" rpy="{rpy}"' if k % 2 == 0 else f'rpy="{rpy}" xyz="{xyz}"'
        if xyz != "0 0 0" or rpy != "0 0 0":
            text += f"    <origin {origin}/> <!-- joint {k + 1} -->\n"
        if kind != "fixed":
            text += f'    <axis xyz="{axis}"/>\n'
        if kind in ("revolute", "prismatic"):
            text += f'    <limit lower="{limits[0]}" upper="{limits[1]}" effort="100" velocity="2"/>\n'
        text += "  </joint>\n"
    return text + "</robot>\n"


def z(name, xyz, rpy, limits, kind="revolute", axis="0 0 1"):
    return (name, kind, xyz, rpy, axis, limits)


TURN = (-2 * PI, 2 * PI)


def universal(name, d1, a2, a3, d4, d5, d6):
    return urdf(name, [
        z("shoulder_pan_joint", f"0 0 {d1}", "0 0 0", TURN),
        z("shoulder_lift_joint", "0 0 0", f"{PI2} 0 0", TURN),
        z("elbow_joint", f"{a2} 0 0", "0 0 0", (-PI, PI)),
        z("wrist_1_joint", f"{a3} 0 {d4}", "0 0 0", TURN),
        z("wrist_2_joint", f"0 {-d5} 0", f"{PI2} 0 0", TURN),
        z("wrist_3_joint", f"0 {d6} 0", f"{PI2} {PI} {PI}", TURN),
        ("wrist_3-flange", "fixed", "0 0 0", f"0 {-PI2} {-PI2}", "", None),
        ("flange-tool0", "fixed", "0 0 0", f"{PI2} 0 {PI2}", "", None),
    ], "tool0")


def write(name, text):
    with open(f"{name}.urdf", "w", encoding="utf-8") as file:
        file.write(text)


write("ur5e", universal("ur5e", 0.1625, -0.425, -0.3922, 0.1333, 0.0997, 0.0996))
write("ur10", universal("ur10", 0.1273, -0.612, -0.5723, 0.163941, 0.1157, 0.0922))
write("panda", urdf("panda", [
    z("panda_joint1", "0 0 0.333", "0 0 0", (-2.8973, 2.8973)),
    z("panda_joint2", "0 0 0", f"{-PI2} 0 0", (-1.7628, 1.7628)),
    z("panda_joint3", "0 -0.316 0", f"{PI2} 0 0", (-2.8973, 2.8973)),
    z("panda_joint4", "0.0825 0 0", f"{PI2} 0 0", (-3.0718, -0.0698)),
    z("panda_joint5", "-0.0825 0.384 0", f"{-PI2} 0 0", (-2.8973, 2.8973)),
    z("panda_joint6", "0 0 0", f"{PI2} 0 0", (-0.0175, 3.7525)),
    z("panda_joint7", "0.088 0 0", f"{PI2} 0 0", (-2.8973, 2.8973)),
    ("panda_joint8", "fixed", "0 0 0.107", "0 0 0", "", None),
], "panda_link8"))
write("iiwa14", urdf("iiwa14", [
    z("iiwa_joint_1", "0 0 0.1575", "0 0 0", (-2.967, 2.967)),
    z("iiwa_joint_2", "0 0 0.2025", f"{PI2} 0 {PI}", (-2.0944, 2.0944)),
    z("iiwa_joint_3", "0 0.2045 0", f"{PI2} 0 {PI}", (-2.967, 2.967)),
    z("iiwa_joint_4", "0 0 0.2155", f"{PI2} 0 0", (-2.0944, 2.0944)),
    z("iiwa_joint_5", "0 0.1845 0", f"{-PI2} {PI} 0", (-2.967, 2.967)),
    z("iiwa_joint_6", "0 0 0.2155", f"{PI2} 0 0", (-2.0944, 2.0944)),
    z("iiwa_joint_7", "0 0.081 0", f"{-PI2} {PI} 0", (-3.0543, 3.0543)),
    ("iiwa_joint_ee", "fixed", "0 0 0.045", "0 0 0", "", None),
], "iiwa_link_ee"))
write("irb120", urdf("irb120", [
    z("joint_1", "0 0 0", "0 0 0", (-2.87979, 2.87979)),
    z("joint_2", "0 0 0.29", "0 0 0", (-1.91986, 1.91986), axis="0 1 0"),
    z("joint_3", "0 0 0.27", "0 0 0", (-1.91986, 1.22173), axis="0 1 0"),
    z("joint_4", "0 0 0.07", "0 0 0", (-2.79253, 2.79253), axis="1 0 0"),
    z("joint_5", "0.302 0 0", "0 0 0", (-2.094395, 2.094395), axis="0 1 0"),
    z("joint_6", "0.072 0 0", "0 0 0", (-6.98132, 6.98132), axis="1 0 0"),
    ("joint_6-tool0", "fixed", "0 0 0", f"0 {PI2} 0", "", None),
], "tool0"))
write("scara", urdf("irb910sc", [
    z("joint_1", "0 0 0.1916", "0 0 0", (-2.443, 2.443)),
    z("joint_2", "0.3 0 0", "0 0 0", (-2.618, 2.618)),
    z("joint_3", "0.25 0 0.0", "0 0 0", (-0.18, 0.0), kind="prismatic"),
    z("joint_4", "0 0 -0.02", f"{PI} 0 0", (-6.98, 6.98)),
    ("flange_joint", "fixed", "0 0 0.03", "0 0 0", "", None),
], "flange"))
