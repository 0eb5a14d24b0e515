"""The commands that ask no question of `geomech.questions`, one file each: ``geomech NAME``
is the function of that name, with _ for -, in the module of that name."""

COMMANDS = {  # by the headings of `geomech --help`, in its order
    "Analyse": ("run",),
    "Your own data": ("fit_gait",),
}  # fmt: skip
