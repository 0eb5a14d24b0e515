"""Frozen words and files: what commands print, write and refuse, kept under data/.

    python tests/tools/golden.py --write    records them; what still holds stays as it
    is

commands.txt has command lines with their output and what they wrote, refusals.txt what
is refused and what its message names, keys.txt every key of a scene file, the schema,
names in Python and their defaults. They are run in a copy of data/frozen, which has
scenes, and a file of every format as the first version with these records wrote it:
later ones read them.

Names, numbers, keys and exit codes are fixed, wording is free (`words`): of a refusal
counts what it names, and that it says what to do. Everything goes through the command
line, files and names of `geomech`; a move of modules needs changes in `namespace` at
most.
"""

from __future__ import annotations

import contextlib
import enum
import importlib
import inspect
import itertools
import json
import math
import os
import pathlib
import re
import shlex
import shutil
import tempfile
import warnings
from collections.abc import Iterator

import commands
import numpy as np
from words import (
    TOLERANCE,
    WORD,
    flat,
    line_holds,
    masked,
    names,
    number_of,
    numbers,
    of_file,
    text_holds,
)

DATA = pathlib.Path(__file__).parents[1] / "data"
FOLDER = DATA / "frozen"
COMMANDS = DATA / "commands.txt"
REFUSALS = DATA / "refusals.txt"
KEYS = DATA / "keys.txt"


DOORS = [
    "rft",
    "geomech",
    "geomech.mathematics.gaits",
    "geomech.studies.measured",
    "geomech.plots",
    "geomech.mathematics.systems",
    "rft.bodies",
    "rft.effects",
]
DOORS += [
    "rft.grains",
    "rft.terradynamics.ground",
    "rft.laws",
    "rft.terradynamics.meshes",
    "rft.mujoco",
    "rft.terradynamics.plates",
    "rft.terradynamics.walking",
]


# What a command does.


def geomech(*args: str) -> tuple[str, str, str]:
    """Return (exit code, standard output, standard error) of a command in this
    process."""
    try:
        code, out, err = commands.geomech(*args)
    except Exception as fault:  # of the program, whose traceback Python prints
        return f"raises {type(fault).__name__}", "", ""
    return str(code or 0), out, err


@contextlib.contextmanager
def place() -> Iterator[pathlib.Path]:
    """A copy of data/frozen, in which commands run."""
    with tempfile.TemporaryDirectory() as folder, contextlib.chdir(folder):
        here = pathlib.Path(shutil.copytree(FOLDER, folder, dirs_exist_ok=True))
        for name in ("folder", "folder.nc", "folder.png"):
            (here / name).mkdir()
        (here / "loop").symlink_to("loop")
        yield here


def files() -> dict[pathlib.Path, int]:
    """Return when each file below the current folder was written."""
    paths = pathlib.Path().rglob("*")
    return {p: os.stat(p).st_mtime_ns for p in paths if os.path.isfile(p)}


# commands.txt


HELP = r"^  (-\S.*?|[\[{A-Z]\S*|[a-z][a-z-]*)(?: <|  |$)"  # its options and commands


def ran(line: str) -> list[str]:
    """Return what came of a command in the current folder, or of several with " ; "
    between them, as lines."""
    if " ; " in line:
        return [told for part in line.split(" ; ") for told in ran(part)]
    before = files()
    code, out, err = geomech(*shlex.split(line))
    if line.endswith("--help"):
        told = [f"= {x}" for x in re.findall(HELP, out, re.M)]
    elif out.startswith("{"):
        told = [f"= {x}" for x in flat(json.loads(out))]
    else:
        told = [f"| {x}" for x in masked(out).splitlines() if x.strip()]
    said = masked(err).splitlines()
    told += [f"! {x}" for x in said if x.startswith(("error:", "note:"))]
    for file, time in sorted(files().items()):
        if before.get(file) != time:
            told += [f"> {file}", *of_file(file)]
    return [*told, f"exit {code}"]


def outcomes(lines: list[str]) -> dict[str, list[str]]:
    """What comes of commands, each in a fresh copy of data/frozen."""
    found = {}
    for line in lines:
        with place(), commands.own_parts():
            found[line] = ran(line)
    return found


def read_commands() -> dict[str, list[str]]:
    """What is recorded of every command."""
    found: dict[str, list[str]] = {}
    for line in COMMANDS.read_text().splitlines():
        if line.startswith("$ geomech "):
            found[line.removeprefix("$ geomech ")] = lines = []
        elif line and not line.startswith("#"):
            lines.append(line)
    return found


def parts(lines: list[str]) -> list[str]:
    """Return lines as they count: what is printed as one text, others by themselves."""
    printed = "\n".join(line for line in lines if line.startswith("| "))
    others = [line for line in lines if not line.startswith("| ")]
    return [printed, *others] if printed else others


def differs(old: list[str], new: list[str]) -> str:
    """Return what of a command's outcome is not as it was, "" where that is at most
    wording."""
    for was, now in itertools.zip_longest(parts(old), parts(new), fillvalue="nothing"):
        holds = text_holds if was[0] in "|!~" else line_holds
        if was[:1] != now[:1] or not holds(was, now):
            return f"was {was}\nnow {now}"
    return ""


# refusals.txt: under [a command, and the file that is changed] what is done to that,
# under [geomech] whole commands, under [python] expressions; each with how it ends,
# what its message names, and "cure" where that says what to do.

CURE = re.compile(  # words of a cure, or of what a value must be
    r"\?$|did you mean|\b(must|such as|possible|takes?|use|give|say|add|put|write|raise|lower|widen|leave|drop|keep|choose"
    r"|name|close|check|install|wait|start|turn|split|end|see|mend|clean|shrink|convert|restore|rename|copy|needs?|belongs"
    r"|from|only|at least|at most|one of|in place of|it has|too few|order|below|above|beyond|within"
    r"|remove|correct|reduce|call|list|optimize|the \w+ are)\b",
    re.I,
)
ORDINARY = {  # words of a sentence as much as of a scene
    "body", "gait", "medium", "motion", "robot", "system", "file", "a", "of", "the", "to", "in", "on", "and", "no", "from", "x",
    "kind", "law", "name", "effects", "numerics", "array", "format", "text", "not", "one", "is", "type", "with", "header", "be",
}  # fmt: skip
TYPES = {
    "array",
    "float",
    "int",
    "str",
    "bool",
    "object",
    "null",
    "float | null",
    "s",
    "m",
}  # words for what a key takes
ESCAPES = {"n": b"\n", "r": b"\r", "t": b"\t", "0": b"\0", "\\": b"\\"}


def namespace() -> dict:
    """Return the names that refusals from Python are written in."""
    import geomech as top
    import rft

    found: dict = {"np": np, "math": math, "rft": rft, "geomech": top}
    for module in (rft, top.systems, top.gaits, top.bodies, top.media, top.effects):
        found |= {name: x for name, x in vars(module).items() if isinstance(x, type)}
    found |= {name: getattr(top, name) for name in public_names(top)}
    modules = ("connection", "curvature", "reconstruct")
    return found | {name: getattr(top.geometry, name) for name in modules}


def raw(text: str) -> bytes:
    """A side of an edit as bytes: \\n, \\r, \\t, \\0, \\\\ and \\xNN are escapes."""
    pieces = re.split(r"\\(x[0-9a-f]{2}|.)", text)
    return b"".join(
        piece.encode()
        if not k % 2
        else bytes.fromhex(piece[1:])
        if len(piece) == 3
        else ESCAPES[piece]
        for k, piece in enumerate(pieces)
    )


def public_names(module) -> list[str]:
    return [name for name in dir(module) if not name.startswith("_")]


def edited(content: bytes, edits: str) -> bytes:
    """Return what a file holds after "old => new", the first time that old is there; "*
    => new" replaces all of it, " => new" is added at its end, and " && " goes between
    several."""
    for edit in edits.split(" && "):
        old, new = (raw(side.strip(" ")) for side in edit.split("=>", 1))
        assert old == b"*" or old in content, f"{old!r} is not there to be changed"
        if old == b"*":
            content = new
        elif old:
            content = content.replace(old, new, 1)
        else:
            content += new
    return content


def refused(section: str, case: str) -> tuple[str, str]:
    """Return (exit code, or the error's class; the message) of a case."""
    if section == "geomech":
        return ended(case)
    if section == "python":
        return raised(case)
    command, _, name = section.partition(" | ")
    named = (word for word in command.split() if (FOLDER / word).is_file())
    file = pathlib.Path(name or next(named))
    before = file.read_bytes()
    try:
        file.write_bytes(edited(before, case))
        return ended(command)
    finally:
        file.write_bytes(before)


def raised(expression: str) -> tuple[str, str]:
    """Return (the error's class, its message) of an expression."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            eval(expression, namespace())
    except Exception as error:
        kind = next(c for c in type(error).__mro__ if c.__module__ == "builtins")
        return kind.__name__, str(error)
    return "nothing", ""


def ended(line: str) -> tuple[str, str]:
    """Return (exit code, message) of a command; with the code what a refusal should not
    do beside its one line."""
    before = files()
    code, out, err = geomech(*shlex.split(line))
    lines = masked(err).splitlines()
    amiss = {
        "prints": out,
        "says more": err.count("\n") != 1,
        "says too much": len(err) > 600,
        "writes": files() != before,
    }
    end = " and ".join([code, *(what for what, found in amiss.items() if found)])
    return end, " ".join(x for x in lines if x.startswith("error: "))


def named(message: str, given: str) -> list[str]:
    """What a refusal calls by name, in its order: what `names` finds, [sections],
    numbers, words and keys that were given."""
    given = given.replace("\\n", " ")
    words = {
        *re.findall(r"[A-Za-z][\w-]+", given),
        *re.findall(r"(\w+) =", given),
    } - ORDINARY
    words &= set(re.findall(r"[A-Za-z](?:[\w-]*\w)?", message))
    found = {word.strip("./") for word in names(message) | words} | set(
        re.findall(r"\[+[a-z.]+\]+", message)
    )
    found = {
        word
        for word in found
        if 0 < len(word) <= 60
        and not re.search("#|_plugin_", word)
        and (word[1:] or word in words)
    } - TYPES
    figures = {
        word.rstrip(".%")
        for word in WORD.findall(message)
        if number_of(word) is not None
    }
    found = {
        word for word in found if not any(word in other for other in found - {word})
    } | figures
    return sorted(found, key=lambda word: (message.find(word), word))[:14]


def outcome(section: str, case: str) -> str:
    """A case's end as it is recorded."""
    code, message = refused(section, case)
    cure = " cure" * bool(CURE.search(message.partition(": ")[2] or message))
    return f"{code} {json.dumps(named(message, f'{section} {case}'), ensure_ascii=False)}{cure}"


def still(recorded: str, section: str, case: str) -> str:
    """Return what of a case is not as it was, "" for nothing: its end, a name that is
    named no more, a cure that is missing."""
    code, message = refused(section, case)
    was, _, rest = recorded.partition(" ")
    wanted, end = json.JSONDecoder().raw_decode(rest)
    lost = [name for name in wanted if not is_named(name, message)]
    if code != was:
        return f"ends with {code} in place of {was}: {message}"
    if lost:
        return f"does not name {', '.join(lost)}: {message}"
    if rest[end:] and not CURE.search(message):
        return f"says no cure: {message}"
    return ""


def is_named(name: str, message: str) -> bool:
    number = number_of(name)
    if number is None:
        return name in message
    return any(math.isclose(number, x, rel_tol=TOLERANCE) for x, _ in numbers(message))


def read_refusals() -> dict[tuple[str, str], str]:
    """(section, case): what is recorded of it, "" for a case that is new."""
    found, section = {}, ""
    for line in REFUSALS.read_text().splitlines():
        if line.startswith("[") and line.endswith("]"):
            section = line[1:-1]
        elif line and not line.startswith("#"):
            case, _, recorded = line.partition(" :: ")
            found[section, case] = recorded
    return found


# keys.txt: what scenes may say, and programs lean on.


def keys() -> Iterator[str]:
    """Every key of a scene file with its type, unit and default; the schema, less its
    descriptions; names in Python, and what is taken where an argument is left out."""
    import geomech as top

    table = ""
    for line in geomech("reference")[1].splitlines():
        if line.startswith("  ") and (
            found := re.match(r"  (\w+)  +(\S.*?)  +(\S.*?)  +(\S.*?)(?:  |$)", line)
        ):
            yield f"key {table}: {' | '.join(found.groups())}"
        elif line.startswith("["):
            table = line
        elif line == "above all tables":
            table = "[]"
    yield from (
        f"schema {line}".replace("/$defs/", "/")
        for line in of_schema(json.loads(geomech("reference", "--json-schema")[1]))
    )
    yield from (
        f"geomech.{name}" for name in sorted(dir(top)) if not name.startswith("_")
    )
    yield from sorted(
        {line for module in DOORS for line in defaults(importlib.import_module(module))}
    )


def defaults(module) -> Iterator[str]:
    """The arguments with defaults of the functions, classes and methods that a module
    offers."""
    for name, x in (
        (name, getattr(module, name))
        for name in dir(module)
        if not name.startswith("_")
    ):
        if callable(x) and re.match(
            "(geomech|rft)[.]", getattr(x, "__module__", None) or ""
        ):
            methods = vars(x) if isinstance(x, type) else {}
            parts = {"": x} | {
                f".{k}": getattr(x, k) for k in methods if not k.startswith("_")
            }
            if isinstance(x, enum.EnumMeta):
                del parts[""]  # arguments that differ between versions of Python
            for part, f in parts.items():
                some = inspect.signature(f).parameters.values() if callable(f) else ()
                if found := [
                    f"{p.name}={p.default!r}" for p in some if p.default is not p.empty
                ]:
                    line = f"default {x.__module__.partition('.')[0]}: {name}{part}({', '.join(found)})"
                    yield re.sub(" at 0x[0-9a-f]+", "", line)


def of_schema(node, path: str = "", before: dict | None = None) -> Iterator[str]:
    """A JSON Schema without its descriptions: a line for what takes little room, else
    one for each of its entries, those of a list by their kind where they have one.
    before: what was told already, and where."""
    text, before = compact(undescribed(node)), {} if before is None else before
    if len(text) <= 200 or not isinstance(node, (dict, list)):
        yield f"{path} {text}"
    elif before.setdefault(text, path) != path:
        yield f"{path} as {before[text]}"
    elif isinstance(node, list):
        for k, inner in enumerate(node):
            yield from of_schema(inner, f"{path}/{kind_of(inner) or k}", before)
    else:
        small = {k: x for k, x in undescribed(node).items() if len(compact(x)) <= 60}
        yield f"{path} {compact(small)}"
        for key in sorted(set(node) - set(small) - {"description"}):
            here = f"{path}/{key}".replace("/properties", "").replace("/oneOf", "")
            yield from of_schema(node[key], here, before)


def compact(node) -> str:
    return json.dumps(node, sort_keys=True, separators=(",", ":"))


def kind_of(node: dict) -> str:
    consts = [
        x["const"]
        for x in node.get("properties", {}).values()
        if isinstance(x, dict) and "const" in x
    ]
    return " ".join(consts)


def undescribed(node):
    if isinstance(node, dict):
        return {
            k: undescribed(x)
            for k, x in node.items()
            if k != "description" or not isinstance(x, str)
        }
    return [undescribed(x) for x in node] if isinstance(node, list) else node


# All of it.


def words_of(lines: list[str]) -> list[str]:
    """Lines without their numbers, to see whether wording changed."""
    return [
        WORD.sub(lambda word: "#" if number_of(word[0]) is not None else word[0], line)
        for line in lines
    ]


def write(say=print) -> None:
    """Records all that does not hold, and new wording; what holds keeps its digits and
    names."""
    lines = [line for line in COMMANDS.read_text().splitlines() if line.startswith("#")]
    recorded = read_commands()
    for command, new in outcomes(list(recorded)).items():
        old = recorded[command]
        if found := differs(old, new):
            say(f"geomech {command}: {found if old else 'new'}")
        lines += [
            f"$ geomech {command}",
            *(new if found or words_of(old) != words_of(new) else old),
        ]
    COMMANDS.write_text("\n".join(lines) + "\n")
    lines, last = (
        [line for line in REFUSALS.read_text().splitlines() if line.startswith("#")],
        "",
    )
    with place():
        for (section, case), old in read_refusals().items():
            if not old or (found := still(old, section, case)):
                say(f"[{section}] {case}: {found if old else 'new'}")
                old = outcome(section, case)
            lines += [f"[{section}]"] * (section != last) + [f"{case} :: {old}"]
            last = section
    REFUSALS.write_text("\n".join(lines) + "\n")
    old, new = KEYS.read_text().splitlines() if KEYS.exists() else [], list(keys())
    for sign, some in (("no more", set(old) - set(new)), ("new", set(new) - set(old))):
        for line in sorted(some):
            say(f"{sign}: {line}")
    KEYS.write_text("\n".join(new) + "\n")
