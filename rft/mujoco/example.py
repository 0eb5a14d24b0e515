"""An example robot, a hexapod on a floor: 1.3 kg, legs that rotate about the y axis.
All its sizes are assumed."""

from __future__ import annotations

import mujoco

HIPS = [(x, y) for x in (-0.08, 0.0, 0.08) for y in (-0.07, 0.07)]  # m
LEG = """<body pos="{} {} 0">
<joint name="j{}" axis="0 1 0" armature="0.002"/>
<geom type="capsule" size=".012" mass=".05" fromto="0 0 0 0 0 -.07" group="2"/>
</body>"""
MOTOR = '<position joint="j{}" kp="4" kv="0.1" forcerange="-2 2"/>'
ROBOT = """<mujoco>
<option timestep="0.002"/>
<default><geom contype="2" conaffinity="1"/></default>
<worldbody>
<geom name="floor" type="plane" size="9 9 1" contype="1" conaffinity="2"/>
<body pos="0 0 .09"><freejoint/>
<geom type="box" size=".1 .05 .02" mass="1" group="1"/>
{}
</body></worldbody>
<actuator>{}</actuator>
</mujoco>"""


def hexapod() -> mujoco.MjModel:
    """Return the compiled robot, with a floor at z = 0; positive rates of its legs
    drive it along x."""
    legs = [LEG.format(x, y, k) for k, (x, y) in enumerate(HIPS)]
    motors = [MOTOR.format(k) for k in range(len(HIPS))]
    text = ROBOT.format("".join(legs), "".join(motors))
    return mujoco.MjModel.from_xml_string(text)
