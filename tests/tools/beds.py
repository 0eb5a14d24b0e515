"""Runs of bodies in grains that obey a law, in place of those of LAMMPS."""

import types

import numpy as np

from geomech.studies.grains import drag as grains
from geomech.studies.grains import swim as grain_swim
from rft import EndCaps, Granular
from rft.grains import Experiment, Run
from rft.grains.motions import Swim

LAW = Granular(3.1, 0.3)
TURN, AHEAD = 0.4, 0.024  # rad/s; m of the chord of half a second
FACTS = {"lammps": 20250722, "grains": 16225}


def obey(patch):
    """Let experiments return runs by the law. patch: a MonkeyPatch."""
    for module in (grains, grain_swim):
        patch.setattr(module, "require_lammps", lambda: None)
    settled = types.SimpleNamespace(facts={"packing": 0.6, "surface": 0.05})
    patch.setattr(grains, "settle", lambda *_: settled)
    patch.setattr(Experiment, "run", run)


def run(experiment, folder, progress=None):
    """Return the run of a rod that is dragged, or of a body that swims."""
    if isinstance(experiment.motion, Swim):
        return swum(experiment)
    return towed(experiment)


def towed(experiment):
    """Return the run of a rod that obeys the law, with 5 % more drag in the fifth
    bed."""
    tow, body = experiment.motion, experiment.body
    n, v = len(body.radius), (np.cos(tow.angle), np.sin(tow.angle))
    strength = 2.0  # N/m
    if experiment.bed.seed == 5:
        strength *= 1.05
    caps = EndCaps(body.half_width / body.size, head=1.7, tail=0.0)
    traction = np.array(LAW.traction(*v))
    spacing = np.diff(body.arc_length[1:-1]).mean()
    profile = np.zeros((200, n, 3))
    profile[..., :2] = -strength * spacing * traction
    rest = strength * (body.size - n * spacing) * traction
    at_end = strength * body.size * np.array(caps.traction(LAW, *v))
    profile[:, -1, :2] -= at_end + rest
    profile[..., 2] = 0.5 / n
    t = np.linspace(0, experiment.duration, 201)[1:]
    nothing = np.zeros((200, 3))
    overlaps = np.full((2, 2), 0.04)
    facts = dict(FACTS)
    return Run(
        t, nothing, nothing, profile, body.arc_length, *[nothing] * 6, overlaps, facts
    )


def swum(experiment):
    """Return the run of a body on an arc, by 24 mm and 0.2 rad in half a second, that
    spends half a watt."""
    t = np.linspace(0, experiment.duration, 1001)[1:]
    theta = TURN * t + 0.3
    place = -1j * np.exp(1j * theta) * AHEAD / abs(np.exp(TURN / 2 * 1j) - 1)
    pose = np.column_stack([place.real, place.imag, theta])
    alpha = np.array([experiment.motion.joint_angles(x)[0] for x in t])
    nothing = np.zeros((1000, 3))
    facts = {**FACTS, "packing": 0.6, "mass": 0.1}
    series = (t, nothing, t, np.zeros((1000, 1, 3)), np.zeros(1), pose, nothing[:, :2])
    return Run(*series, alpha, 0.5 * t, t, nothing, np.ones((2, 2)), facts)
