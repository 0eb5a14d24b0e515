"""Frozen words and files: what commands print, write and refuse, kept under data/.

    python tests/tools/golden.py --write    records them; what still holds stays as it
    is

commands.txt has command lines with their output and what they wrote, refusals.txt what
is refused and what its message names, keys.txt every key of a scene file, the schema,
names in Python and their defaults. They are run in a copy of data/frozen, which has
scenes, and a file of every format as the first version with these records wrote it:
later ones read them.

Names, numbers, keys and exit codes are fixed, wording is free (`words`): of a refusal
counts what it names, and which of its facts it has, such as a reason. Everything goes through the command
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
from typing import NamedTuple
from unittest import mock

import commands
import numpy as np
from refusals import facts
from words import (
    TOLERANCE,
    WORD,
    bare,
    flat,
    line_holds,
    masked,
    names,
    number_of,
    numbers,
    of_file,
    text_holds,
)

from rft.core.refusal import Refusal

DATA = pathlib.Path(__file__).parents[1] / "data"
FOLDER = DATA / "frozen"
COMMANDS = DATA / "commands.txt"
REFUSALS = DATA / "refusals.txt"
KEYS = DATA / "keys.txt"

# Modules whose names programs use.
DOORS = [
    "rft",
    "geomech",
    "geomech.mathematics.gaits",
    "geomech.studies.measured",
    "geomech.plots",
    "geomech.mathematics.systems",
    "rft.bodies",
    "rft.effects",
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

# Options and commands in a help text.
HELP = r"^  (-\S.*?|[\[{A-Z]\S*|[a-z][a-z-]*)(?: <|  |$)"


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
# what its message names, which facts a `Refusal` has, and "cure" where other words of
# it say what to do.

CURES = """did you mean|must|such as|possible|takes?|use|give|say|add|put|write|raise
|lower|widen|leave|drop|keep|choose|name|close|check|install|wait|start|turn|split|end
|see|mend|clean|shrink|convert|restore|rename|copy|needs?|belongs|from|only|at least
|at most|one of|in place of|it has|too few|order|below|above|beyond|within|remove
|correct|reduce|call|list|optimize|the \\w+ are"""
# Words of a cure, or of what a value must be.
CURE = re.compile(rf"\?$|\b({CURES.replace(chr(10), '')})\b", re.I)
ORDINARY = {  # words of a sentence as much as of a scene
    *("body", "gait", "medium", "motion", "robot", "system", "file", "kind", "law"),
    *("name", "effects", "numerics", "array", "format", "text", "type", "header", "x"),
    *("a", "of", "the", "to", "in", "on", "and", "no", "not", "from", "one", "is"),
    *("with", "be"),
}
TYPES = {  # words for what a key takes
    *("array", "float", "int", "str", "bool", "object", "null", "float | null"),
    *("s", "m"),
}
MOST_NAMES = 14  # of a refusal that are recorded
ESCAPES = {"n": "\n", "r": "\r", "t": "\t", "0": "\0", "\\": "\\"}


def namespace() -> dict:
    """Return the names that refusals from Python are written in."""
    import geomech as top
    import rft

    found: dict = {"np": np, "math": math, "rft": rft, "geomech": top}
    for module in (rft, top.systems, top.gaits, top.bodies, top.media, top.effects):
        for name, x in vars(module).items():
            if isinstance(x, type):
                found[name] = x
    for name in public_names(top):
        found[name] = getattr(top, name)
    for name in ("connection", "curvature", "reconstruct"):
        found[name] = getattr(top.geometry, name)
    return found


def raw(text: str) -> bytes:
    """Return a side of an edit as bytes: \\n, \\r, \\t, \\0, \\\\ and \\xNN are
    escapes."""

    def character(found: re.Match) -> str:
        escape = found[1]
        if len(escape) == 3:  # of a byte, which latin-1 gives back below
            return chr(int(escape[1:], 16))
        return ESCAPES[escape]

    # Letters beyond one byte are bytes of UTF-8 first.
    latin = text.encode().decode("latin-1")
    return re.sub(r"\\(x[0-9a-f]{2}|.)", character, latin).encode("latin-1")


def public_names(module) -> list[str]:
    return [name for name in dir(module) if not name.startswith("_")]


def edited(content: bytes, edits: str) -> bytes:
    """Return what a file holds after "old => new", the first time that old is there; "*
    => new" replaces all of it, " => new" is added at its end, and " && " goes between
    several."""
    for edit in edits.split(" && "):
        before, after = edit.split("=>", 1)
        old = raw(before.strip(" "))
        new = raw(after.strip(" "))
        assert old == b"*" or old in content, f"{old!r} is not there to be changed"
        if old == b"*":
            content = new
        elif old:
            content = content.replace(old, new, 1)
        else:
            content += new
    return content


class Refused(NamedTuple):
    """How a case ends."""

    code: str  # or the error's class
    message: str
    facts: list[str]

    def has_cure(self) -> bool:
        """Return whether the message says what to do, or what a value must be."""
        if "instead" in self.facts:
            return True
        after_place = self.message.partition(": ")[2] or self.message
        return bool(CURE.search(after_place))


@contextlib.contextmanager
def printed_refusals() -> Iterator[list[Refusal]]:
    """Collect the refusals that become text within, the one that is printed last."""
    found: list[Refusal] = []
    as_line = Refusal.as_line

    def noted(refusal: Refusal, spelled) -> str:
        found.append(refusal)
        return as_line(refusal, spelled)

    with mock.patch.object(Refusal, "as_line", noted):
        yield found


def refused(section: str, case: str) -> Refused:
    """Return how a case ends."""
    if section == "geomech":
        return ended(case)
    if section == "python":
        return raised(case)
    command, _, name = section.partition(" | ")
    if not name:  # the first file that the command names
        name = next(word for word in command.split() if (FOLDER / word).is_file())
    file = pathlib.Path(name)
    before = file.read_bytes()
    try:
        file.write_bytes(edited(before, case))
        return ended(command)
    finally:
        file.write_bytes(before)


def raised(expression: str) -> Refused:
    """Return how an expression ends."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            eval(expression, namespace())
    except Exception as error:
        kind = next(c for c in type(error).__mro__ if c.__module__ == "builtins")
        found = facts(error) if isinstance(error, Refusal) else []
        return Refused(kind.__name__, str(error), found)
    return Refused("nothing", "", [])


def ended(line: str) -> Refused:
    """Return how a command ends; with the code what a refusal should not do beside its
    one line."""
    before = files()
    with printed_refusals() as refusals:
        code, out, err = geomech(*shlex.split(line))
    lines = masked(err).splitlines()
    amiss = {
        "prints": out,
        "says more": err.count("\n") != 1,
        "says too much": len(err) > 600,
        "writes": files() != before,
    }
    ends = [code]
    for what, found in amiss.items():
        if found:
            ends.append(what)
    message = " ".join(line for line in lines if line.startswith("error: "))
    found = facts(refusals[-1]) if refusals else []
    return Refused(" and ".join(ends), message, found)


def named(message: str, given: str) -> list[str]:
    """Return what a refusal calls by name, in its order: what `names` finds,
    [sections], numbers, words and keys that were given."""
    given = given.replace("\\n", " ")
    words = {*re.findall(r"[A-Za-z][\w-]+", given), *re.findall(r"(\w+) =", given)}
    words -= ORDINARY
    words &= {*re.findall(r"[A-Za-z](?:[\w-]*\w)?", message)}
    found = {word.strip("./") for word in names(message) | words}
    found.update(re.findall(r"\[+[a-z.]+\]+", message))
    found = {word for word in found if is_recorded(word, words)}
    found = {word for word in found if not is_part(word, found)}
    for word in WORD.findall(message):
        if number_of(word) is not None:
            found.add(word.rstrip(".%"))
    in_order = sorted(found, key=lambda word: (message.find(word), word))
    return in_order[:MOST_NAMES]


def is_recorded(word: str, given: set[str]) -> bool:
    """Return whether a name of a refusal is one that counts. given: words of the
    case."""
    if not 0 < len(word) <= 60 or word in TYPES:
        return False
    if re.search("#|_plugin_", word):  # masked, or of a temporary name
        return False
    return len(word) > 1 or word in given


def is_part(word: str, others: set[str]) -> bool:
    """Return whether a word is part of another one."""
    return any(word in other for other in others - {word})


def outcome(section: str, case: str) -> str:
    """Return a case's end as it is recorded."""
    end = refused(section, case)
    found = named(end.message, f"{section} {case}")
    return f"{end.code} {json.dumps(found, ensure_ascii=False)} {told(end)}".rstrip()


def told(end: Refused) -> str:
    """Return what a case tells beside names, such as "where because instead"."""
    cure = ["cure"] if end.has_cure() and "instead" not in end.facts else []
    return " ".join([*end.facts, *cure])


def still(recorded: str, section: str, case: str) -> str:
    """Return what of a case is not as it was, "" for nothing: its end, a name that is
    named no more, its facts."""
    end = refused(section, case)
    was, _, rest = recorded.partition(" ")
    wanted, length = json.JSONDecoder().raw_decode(rest)
    lost = [name for name in wanted if not is_named(name, end.message)]
    facts_before = rest[length:].strip()
    if end.code != was:
        return f"ends with {end.code} in place of {was}: {end.message}"
    if lost:
        return f"does not name {', '.join(lost)}: {end.message}"
    if told(end) != facts_before:
        return f"tells {told(end)!r} in place of {facts_before!r}: {end.message}"
    return ""


def is_named(name: str, message: str) -> bool:
    """Return whether a message has a name, or a number but for its last digits."""
    number = number_of(name)
    if number is None:
        return name in message
    return any(math.isclose(number, x, rel_tol=TOLERANCE) for x, _ in numbers(message))


def read_refusals() -> dict[tuple[str, str], str]:
    """Return (section, case): what is recorded of it, "" for a case that is new."""
    found: dict[tuple[str, str], str] = {}
    section = ""
    for line in REFUSALS.read_text().splitlines():
        if line.startswith("[") and line.endswith("]"):
            section = line[1:-1]
        elif line and not line.startswith("#"):
            case, _, recorded = line.partition(" :: ")
            found[section, case] = recorded
    return found


# keys.txt: what scenes may say, and programs lean on.


KEY = re.compile(r"  (\w+)  +(\S.*?)  +(\S.*?)  +(\S.*?)(?:  |$)")


def keys() -> Iterator[str]:
    """Yield every key of a scene file with its type, unit and default; the schema, less
    its descriptions; names in Python, and what is taken where an argument is left
    out."""
    import geomech as top

    table = ""
    for line in geomech("reference")[1].splitlines():
        found = KEY.match(line)
        if found:
            yield f"key {table}: {' | '.join(found.groups())}"
        elif line.startswith("["):
            table = line
        elif line == "above all tables":
            table = "[]"
    schema = json.loads(geomech("reference", "--json-schema")[1])
    for line in of_schema(schema):
        yield f"schema {line}".replace("/$defs/", "/")
    for name in sorted(public_names(top)):
        yield f"geomech.{name}"
    lines: set[str] = set()
    for door in DOORS:
        lines.update(defaults(importlib.import_module(door)))
    yield from sorted(lines)


def defaults(module) -> Iterator[str]:
    """Yield the arguments with defaults of the functions, classes and methods that a
    module offers."""
    for name in public_names(module):
        offered = getattr(module, name)
        origin = getattr(offered, "__module__", None) or ""
        if not callable(offered) or not origin.startswith(("geomech.", "rft.")):
            continue
        parts = {name: offered}
        if isinstance(offered, type):
            for method in vars(offered):
                if not method.startswith("_"):
                    parts[f"{name}.{method}"] = getattr(offered, method)
        if isinstance(offered, enum.EnumMeta):
            del parts[name]  # arguments that differ between versions of Python
        for part, function in parts.items():
            arguments = ", ".join(given_defaults(function))
            if arguments:
                line = f"default {origin.partition('.')[0]}: {part}({arguments})"
                yield re.sub(" at 0x[0-9a-f]+", "", line)


def given_defaults(function) -> Iterator[str]:
    """Yield "name=default" of the arguments of a function; nothing of what is none."""
    if not callable(function):
        return
    for parameter in inspect.signature(function).parameters.values():
        if parameter.default is not parameter.empty:
            yield f"{parameter.name}={parameter.default!r}"


def of_schema(node, path: str = "", before: dict | None = None) -> Iterator[str]:
    """A JSON Schema without its descriptions: a line for what takes little room, else
    one for each of its entries, those of a list by their kind where they have one.
    before: what was told already, and where."""
    if before is None:
        before = {}
    text = compact(undescribed(node))
    if len(text) <= 200 or not isinstance(node, (dict, list)):
        yield f"{path} {text}"
    elif before.setdefault(text, path) != path:
        yield f"{path} as {before[text]}"
    elif isinstance(node, list):
        for k, inner in enumerate(node):
            yield from of_schema(inner, f"{path}/{kind_of(inner) or k}", before)
    else:
        small = {}
        for key, inner in undescribed(node).items():
            if len(compact(inner)) <= 60:
                small[key] = inner
        yield f"{path} {compact(small)}"
        for key in sorted({*node} - {*small} - {"description"}):
            here = f"{path}/{key}".replace("/properties", "").replace("/oneOf", "")
            yield from of_schema(node[key], here, before)


def compact(node) -> str:
    return json.dumps(node, sort_keys=True, separators=(",", ":"))


def kind_of(node: dict) -> str:
    """Return the constants by which an entry of a schema is told from others."""
    constants = []
    for inner in node.get("properties", {}).values():
        if isinstance(inner, dict) and "const" in inner:
            constants.append(inner["const"])
    return " ".join(constants)


def undescribed(node):
    """Return a schema without its descriptions; a key may have that name."""
    if isinstance(node, list):
        return [undescribed(inner) for inner in node]
    if not isinstance(node, dict):
        return node
    kept = {}
    for key, inner in node.items():
        if key != "description" or not isinstance(inner, str):
            kept[key] = undescribed(inner)
    return kept


# All of it.


def write(say=print) -> None:
    """Record all that does not hold, and new wording; what holds keeps its digits and
    names."""
    write_commands(say)
    write_refusals(say)
    write_keys(say)


def comments(file: pathlib.Path) -> list[str]:
    return [line for line in file.read_text().splitlines() if line.startswith("#")]


def write_commands(say) -> None:
    lines = comments(COMMANDS)
    recorded = read_commands()
    for command, new in outcomes([*recorded]).items():
        old = recorded[command]
        found = differs(old, new)
        if found:
            say(f"geomech {command}: {found if old else 'new'}")
        is_new = found or [*map(bare, old)] != [*map(bare, new)]
        lines += [f"$ geomech {command}", *(new if is_new else old)]
    COMMANDS.write_text("\n".join(lines) + "\n")


def write_refusals(say) -> None:
    lines = comments(REFUSALS)
    last = ""
    with place():
        for (section, case), recorded in read_refusals().items():
            end = recorded
            found = "new"
            if recorded:
                found = still(recorded, section, case)
            if found:
                say(f"[{section}] {case}: {found}")
                end = outcome(section, case)
            if section != last:
                lines.append(f"[{section}]")
            lines.append(f"{case} :: {end}")
            last = section
    REFUSALS.write_text("\n".join(lines) + "\n")


def write_keys(say) -> None:
    old = []
    if KEYS.exists():
        old = KEYS.read_text().splitlines()
    new = [*keys()]
    for line in sorted({*old} - {*new}):
        say(f"no more: {line}")
    for line in sorted({*new} - {*old}):
        say(f"new: {line}")
    KEYS.write_text("\n".join(new) + "\n")
