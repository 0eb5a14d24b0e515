"""The commands, one file each: ``geomech NAME`` is the function NAME of the module NAME. A new one is a file and its name
here; `geomech.commands.options` and `loading` have what they share."""

COMMANDS = (
    "run", "velocity", "connection", "ccf", "displacement", "trajectory", "animate", "accuracy", "sweep", "optimize",
    "fit", "calibrate", "stress", "intrude", "walk", "explain", "symbolic", "scenes", "keys",
)  # fmt: skip
