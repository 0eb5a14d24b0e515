"""The commands, one file each: ``geomech NAME`` is the function of that name, with _ for -, in the module of that name. A new
one is a file and its name here; `geomech.commands.options` and `loading` have what they share."""

COMMANDS = {  # by the headings of `geomech --help`, in its order
    "Analyse": (
        "run",
        "displacement",
        "ccf",
        "connection",
        "velocity",
        "symbolic",
        "sweep",
        "accuracy",
        "lab",
    ),
    "Gaits": ("trajectory", "forces", "optimize"),
    "Grains and robots": ("stress", "intrude", "walk", "grains", "drag_grains"),
    "Your own data": ("fit_medium", "fit_gait"),
    "Reference": ("scenes", "reference", "explain"),
}
