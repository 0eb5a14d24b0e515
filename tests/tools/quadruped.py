"""A robot on four legs, as MJCF: what stands and trots in sand."""

import numpy as np

HIP_PLACES = ((0.19, 0.13), (0.19, -0.13), (-0.19, 0.13), (-0.19, -0.13))  # m
STANCE = np.tile([0.0, 0.75, -1.5], 4)  # rad
LEG = """<body pos="{x} {y} 0"><joint name="a{n}" axis="1 0 0"/><joint name="b{n}" axis="0 1 0"/>
<geom type="capsule" size=".02" fromto="0 0 0 0 0 -.21" mass="1"/><body pos="0 0 -.21">
<joint name="c{n}" axis="0 1 0" range="-2.7 -.6"/><geom type="capsule" size=".012" fromto="0 0 0 0 0 -.2" mass=".2"/>
<geom name="foot{n}" type="sphere" size=".022" pos="0 0 -.21" mass=".05"/></body></body>"""
MOTOR = '<position joint="{}" kp="150" kv="3" forcerange="-35 35"/>'
ROBOT = """<mujoco><compiler angle="radian"/><option timestep="{}"/><default>
<joint armature=".01" damping=".1"/><geom contype="2" conaffinity="1"/></default><worldbody>
<body pos="0 0 .33"><freejoint/><geom type="box" size=".19 .05 .05" mass="6"/>{}</body>
</worldbody><actuator>{}</actuator></mujoco>"""


def quadruped(step):
    """Return a compiled robot of 12 kg with two capsules, a foot and three motors a
    leg."""
    import mujoco

    places = enumerate(HIP_PLACES)
    legs = "".join(LEG.format(x=x, y=y, n=n) for n, (x, y) in places)
    motors = "".join(MOTOR.format(f"{j}{n}") for n in range(4) for j in "abc")
    return mujoco.MjModel.from_xml_string(ROBOT.format(step, legs, motors))
