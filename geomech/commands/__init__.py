"""The commands that ask no question of `geomech.questions`, one file each: ``geomech NAME``
is the function of that name, with _ for -, in the module of that name."""

COMMANDS = {  # by the headings of `geomech --help`, in its order
    "Analyse": (
        "run", "symbolic", "accuracy", "lab"
    ),
    "Gaits": ("trajectory",),
    "Grains and robots": ("grains", "drag_grains"),
    "Your own data": (),
    "Reference": ("scenes", "reference", "explain"),
}  # fmt: skip
