"""Commands that describe: they answer with text or a page, and ask no question.

One file each: ``geomech NAME`` is the function of that name in the module of that name,
with the texts that it prints. A command here is a file and a line below.
"""

# By the headings of `geomech --help-all`, as in `geomech.questions`. The lines are
# given here so that the list of commands loads none of them.
GROUPS = {
    "Analyse": {
        "symbolic": "Print connection and CCF in closed form.",
        "lab": "Write a page to draw loops on the CCF and watch the swimmer.",
    },
    "Reference": {
        "scenes": "List the built-in scenes and the named media.",
        "reference": "Print every key of a scene file.",
        "explain": "Print effects, engine and cost of a scene.",
    },
}
SUMMARIES = {name: line for lines in GROUPS.values() for name, line in lines.items()}
