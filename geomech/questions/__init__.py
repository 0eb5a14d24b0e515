"""Questions, one a file: its fields, its checks, its computation, its headline and its
picture.

A new one is a file and a line here. Its command, its method of `geomech.study(...)`,
its reference and JSON Schema, the digest under which an interrupted computation is
resumed, files of all formats and its form in a notebook follow from its class.
"""

from importlib import import_module
from typing import Any

# By the headings of `geomech --help`, in its order. The lines are given here, too, so
# that the list of commands loads no question.
GROUPS = {
    "Analyse": {
        "displacement": "Compute the displacement of a gait by each tier.",
        "ccf": "Compute the CCF and its integral over the scene's gait.",
        "connection": "Compute the local connection on a grid.",
        "velocity": "Compute the body velocity of one shape and its rate.",
        "sweep": "Compute displacement or speed over a grid of parameters.",
        "run": "Compute connection, CCF and displacements into a folder.",
        "accuracy": "Measure error against time for every tier and setting.",
    },
    "Gaits": {
        "forces": "Compute force, power and bending moment along the body.",
        "optimize": "Find the best gait for an objective.",
        "trajectory": "Follow the body through its gait.",
    },
    "Grains and robots": {
        "stress": "Compute the stress of grains on a plate per unit depth.",
        "intrude": "Compute force and moment of grains on a moving body.",
        "walk": "Compute how a robot walks on grains.",
        "grains": "Let rigid links swim in a bed of grains, beside the tiers.",
        "drag_grains": "Measure the drag of grains on a rod and on its ends.",
    },
    "Your own data": {
        "fit_medium": "Fit a medium to your own drag data.",
        "fit_gait": "Fit a measured gait.",
    },
}
SUMMARIES = {name: line for lines in GROUPS.values() for name, line in lines.items()}


def question(name: str) -> Any:
    """Return the class of a question, such as `Velocity` for "velocity"; KeyError for
    an unknown name."""
    if name not in SUMMARIES:
        raise KeyError(name)
    class_name = "".join(part.capitalize() for part in name.split("_"))
    return getattr(import_module(f"geomech.questions.{name}"), class_name)
