"""Two robots as files: a URDF, and a table of Denavit-Hartenberg parameters."""

BODY = '<inertial><mass value="1"/><inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial>'
URDF = f"""<robot name="two"><link name="base"/><link name="l1">{BODY}</link><link name="l2">{BODY}</link>
<joint name="j1" type="revolute"><parent link="base"/><child link="l1"/>
<limit lower="-1" upper="1" velocity="2" effort="3"/><dynamics damping="0.5" friction="0.25"/></joint>
<joint name="j2" type="prismatic"><parent link="l1"/><child link="l2"/><origin xyz="1 0 0"/>
<limit lower="-0.1" upper="0.1" velocity="0.2" effort="30"/></joint></robot>
"""
TABLE = """\
name: pair
geometry:
  convention: standard
  angles: deg
  joints:
    - {alpha: 90, a: 0.5, d: 0.1}
    - {kind: prismatic, alpha: 0, a: 0, d: 0.2, offset: 90}
limits:
  position: {lower: [-90, -100], upper: [90, 100], unit: [deg, mm]}
  velocity: {values: [180, .inf], unit: [deg/s, m/s]}
dynamics:
  links:
    - {mass: 2, com: [-0.25, 0, 0], inertia_at_com: [0.01, 0, 0, 0.02, 0, 0.03]}
    - {mass: 1, com: [0, 0, 0], inertia_at_com: [0.01, 0, 0, 0.01, 0, 0.01]}
  drives:
    gear_ratio: {values: [100, 20]}
    rotor_inertia: {values: [1e-5, 2E-5]}
    torque_constant: {values: [0.1, 0.2]}
  friction:
    coulomb: {values: [1, 2]}
    cubic: {values: [3, 4]}
"""
