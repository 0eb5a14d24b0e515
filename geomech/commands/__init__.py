"""The commands that ask no question of `geomech.questions`, one file each: ``geomech NAME``
is the function of that name, with _ for -, in the module of that name."""

COMMANDS = {"Your own data": ("fit_gait",)}  # by the headings of `geomech --help`
