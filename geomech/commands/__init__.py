"""The commands that ask no question of `geomech.questions`, one file each: ``geomech NAME``
is the function of that name, with _ for -, in the module of that name."""

COMMANDS = {  # by the headings of `geomech --help`, in its order
    "Analyse": (
        "symbolic", "accuracy", "lab"
    ),
    "Gaits": (),
    "Grains and robots": ("grains", "drag_grains"),
    "Your own data": ("fit_medium", "fit_gait"),
    "Reference": ("scenes", "reference", "explain"),
}  # fmt: skip
