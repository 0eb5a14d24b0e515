"""Questions, one a file: its fields, its checks, its computation, its headline and its
picture.

A new one is a file in a room and a line here. Its command, its method of
`geomech.study(...)`, its reference and JSON Schema, the digest under which an
interrupted computation is resumed, files of all formats and its form in a notebook
follow from its class.
"""

from importlib import import_module
from typing import Any

# By the headings of `geomech --help-all`, in its order: the module of a question, named
# after it, and the line of its command, which is given here so that the list of
# commands loads no question.
GROUPS = {
    "Analyse": {
        "swimmers.displacement": "Compute the displacement of a gait by each tier.",
        "swimmers.ccf": "Compute the CCF and its integral over the scene's gait.",
        "swimmers.connection": "Compute the local connection on a grid.",
        "swimmers.velocity": "Compute the body velocity of one shape and its rate.",
        "swimmers.sweep": "Compute displacement or speed over a grid of parameters.",
        "swimmers.run": "Compute connection, CCF and displacements into a folder.",
        "swimmers.accuracy": "Measure error against time for every tier and setting.",
    },
    "Gaits": {
        "swimmers.forces": "Compute force, power and bending moment along the body.",
        "swimmers.optimize": "Find the best gait for an objective.",
        "swimmers.trajectory": "Follow the body through its gait.",
    },
    "Grains and robots": {
        "terradynamics.stress": (
            "Compute the stress of grains on a plate per unit depth."
        ),
        "terradynamics.intrude": "Compute force and moment of grains on a moving body.",
        "terradynamics.walk": "Compute how a robot walks on grains.",
        "grains.grains": "Simulate rigid links that swim in a bed of grains.",
        "grains.drag_grains": "Measure the drag of grains on a rod and on its ends.",
    },
    "Your own data": {
        "measured.fit_medium": "Fit a medium to your own drag data.",
        "measured.fit_gait": "Fit a measured gait.",
    },
}


def question_name(module: str) -> str:
    """Return "velocity" for "swimmers.velocity"."""
    return module.rpartition(".")[2]


SUMMARIES = {
    question_name(module): line
    for lines in GROUPS.values()
    for module, line in lines.items()
}
MODULES = {
    question_name(module): module for lines in GROUPS.values() for module in lines
}


def question(name: str) -> Any:
    """Return the class of a question, such as `Velocity` for "velocity"; KeyError for
    an unknown name."""
    class_name = "".join(part.capitalize() for part in name.split("_"))
    module = import_module(f"geomech.questions.{MODULES[name]}")
    return getattr(module, class_name)
