"""Small bugs put into the code on purpose, to see whether a test notices. By hand, not
collected by pytest:

    python tests/tools/mutants.py calls.txt --measure
    python tests/tools/mutants.py calls.txt --count 200 --seed 1 --jobs 2
    python tests/tools/mutants.py calls.txt --count 200 --seed 1 --map map.jsonl
    python tests/tools/mutants.py calls.txt --needed map.jsonl

The first line runs the suite and the examples of docstrings once and notes which
functions each test calls, and its seconds. A mutant then meets the tests that call the
function in which it stands (of a constant: any of its class, file or folder, those in
files that name it first), quickest first, and as far as `--enough` seconds go, the rest
of their files, which may look at what a fixture or a cache holds. Tests deleted since
the measurement are left out; of tests added since nothing is known. `mutants.toml` beside this file names the tests of what
Python does not see called, what is left out and which mutants are no bugs. Mutants live
in copies of the tree in the system's temporary folder, one a worker; the checkout is
only read. A mutant is killed when a test fails; time-outs, far longer than without it,
are counted apart. Survivors are printed as what they change.
`--done 50` goes on with a run that was stopped after 50. `--rooms laws shell` measures
the tests of these folders of `tests/` alone, for a change of one room.

`--map` runs all tests of a mutant, not only as far as the first that fails, and adds a
line for each mutant to a file: what it changes, and which tests notice. `--needed`
reads such files and prints a set of tests that notices every mutant that any test
noticed, cheapest first as far as a greedy choice goes, and the tests that it does
without.
"""

import argparse
import ast
import collections
import copy
import difflib
import importlib
import inspect
import itertools
import json
import os
import random
import re
import resource
import shutil
import signal
import subprocess
import sys
import tempfile
import threading
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).parents[2]
PACKAGES = "rft/", "geomech/"
TABLE = tomllib.loads((ROOT / "tests/tools/mutants.toml").read_text())
# In one process and without time limits of its own, whatever the suite's settings are.
PYTEST = [
    *("-q", "--doctest-modules", "--assert=plain", "-p", "no:cacheprovider"),
    *("-o", "addopts=", "-o", "timeout=0", "-m", "not soak and not benchmark"),
]
# Loaded once, before each mutant's process splits off.
HEAVY = "pytest numpy scipy.interpolate scipy.special scipy.stats sympy mpmath matplotlib.pyplot xarray"
CLEAN = {
    "PYTHONDONTWRITEBYTECODE": "1",
    "OMP_NUM_THREADS": "1",
    "OPENBLAS_NUM_THREADS": "1",
    "MPLBACKEND": "agg",
}


def both_ways(pairs):
    return {**pairs, **{b: a for a, b in pairs.items()}}


SWAPPED = both_ways({ast.Add: ast.Sub, ast.Mult: ast.Div, ast.BitAnd: ast.BitOr})
SWAPPED |= {ast.Pow: ast.Mult, ast.FloorDiv: ast.Mult, ast.Mod: ast.FloorDiv}
BORDER = both_ways({ast.Lt: ast.LtE, ast.Gt: ast.GtE})
OPPOSITE = both_ways({
    ast.Lt: ast.GtE, ast.LtE: ast.Gt, ast.Eq: ast.NotEq, ast.Is: ast.IsNot,
    ast.In: ast.NotIn,
})  # fmt: skip
TWIN = both_ways({
    "minimum": "maximum", "min": "max", "sin": "cos", "real": "imag", "any": "all",
    "zeros": "ones", "zeros_like": "ones_like", "floor": "ceil", "sum": "mean",
    "argmin": "argmax", "exp": "expm1",
})  # fmt: skip
# Functions of two arguments that may come in either order.
EITHER_WAY = {
    *("max", "min", "maximum", "minimum", "fmax", "fmin", "hypot"),
    *("distance", "pose_distance", "dot", "plus"),
}


class Mutant(NamedTuple):
    file: str
    line: int
    scope: str  # qualified name of the function or class around it, "" outside of all
    source: str  # of the whole file
    mutated: str

    def change(self) -> str:
        """The lines taken away (-) and put in (+)."""
        lines = difflib.unified_diff(
            self.source.splitlines(), self.mutated.splitlines(), n=0, lineterm=""
        )
        return "\n".join(x[0] + " " + x[1:].strip() for x in list(lines)[3:])


def variants(node):
    """(part, replacement) for every wrong form of a syntax node."""

    def with_(**fields):
        new = copy.copy(node)
        vars(new).update(fields)
        return node, new

    match node:
        case ast.BinOp(op=op) if type(op) in SWAPPED:
            yield with_(op=SWAPPED[type(op)]())
        case ast.Compare(ops=ops):
            for k, op in enumerate(ops):
                for table in (BORDER, OPPOSITE):
                    if type(op) in table:
                        yield with_(ops=[*ops[:k], table[type(op)](), *ops[k + 1 :]])
        case ast.BoolOp(op=op):
            yield with_(op=ast.And() if isinstance(op, ast.Or) else ast.Or())
        case ast.UnaryOp(op=ast.USub() | ast.Not() | ast.Invert()):
            yield node, node.operand
        case ast.Constant(value=bool(x)):
            yield node, ast.Constant(not x)
        case ast.Constant(value=x) if isinstance(x, (int, float, complex)):
            yield from ((node, ast.Constant(y)) for y in ((2 * x, -x) if x else (1,)))
        case ast.Attribute(attr=name) if name in TWIN:
            yield with_(attr=TWIN[name])
        case ast.Call(args=args, keywords=given):
            for k in range(len(given)):
                yield with_(keywords=[*given[:k], *given[k + 1 :]])
            name = ast.unparse(node.func).rpartition(".")[2]
            either_way = len(args) == 2 and name in EITHER_WAY
            first = {ast.dump(x) for x in args[:2] if not isinstance(x, ast.Starred)}
            if len(first) == 2 and not either_way:
                yield with_(args=[args[1], args[0], *args[2:]])
        case ast.If(test=test) | ast.IfExp(test=test):
            yield test, ast.UnaryOp(ast.Not(), test)
        case ast.Return(value=ast.BinOp() | ast.UnaryOp() | ast.Call() as value):
            yield value, ast.UnaryOp(ast.USub(), value)
        case (
            ast.AugAssign()
            | ast.Raise()
            | ast.Expr(value=ast.Call())
            | ast.Assign(targets=[ast.Subscript()])
        ):
            yield node, ast.Pass()


def nodes(tree):
    """The nodes of a tree that may be mutated: not texts, annotations, decorators, nor
    what the table says to skip."""
    for field, value in ast.iter_fields(tree):
        if field in ("annotation", "returns", "decorator_list"):
            continue
        for node in value if isinstance(value, list) else [value]:
            if not isinstance(node, ast.AST) or isinstance(node, ast.JoinedStr):
                continue
            name = getattr(node, "name", None)
            if isinstance(node, ast.Assign):
                name = ast.unparse(node.targets[0])
            if name not in TABLE["skip"]:
                yield node
                if not isinstance(node, ast.Raise):
                    yield from nodes(node)


def scopes(node, name=""):
    """(first line, last line, qualified name) of a tree and of each function and class
    in it, outer ones first."""
    if isinstance(node, ast.Module):
        yield 0, sys.maxsize, name
    for x in ast.iter_child_nodes(node):
        if isinstance(x, (ast.FunctionDef, ast.ClassDef)):
            yield x.lineno, x.end_lineno, name + x.name
            yield from scopes(
                x, f"{name}{x.name}." + "<locals>." * isinstance(x, ast.FunctionDef)
            )
        else:
            yield from scopes(x, name)


def mutants_of(path: Path) -> list[Mutant]:
    text = path.read_bytes()
    starts = [0, *(i + 1 for i, byte in enumerate(text) if byte == 10)]
    tree = ast.parse(text)
    around = list(scopes(tree))
    found = {}
    for part, new in (v for node in nodes(tree) for v in variants(node)):
        low = starts[part.lineno - 1] + part.col_offset
        high = starts[part.end_lineno - 1] + part.end_col_offset
        code = ast.unparse(ast.fix_missing_locations(new))
        if not isinstance(new, (ast.stmt, ast.Name, ast.Constant)) or "-" in code:
            code = f"({code})"
        mutated = (text[:low] + code.encode() + text[high:]).decode()
        line = part.lineno
        scope = [name for first, last, name in around if first <= line <= last][-1]
        file = path.relative_to(ROOT).as_posix()
        found[mutated] = Mutant(file, line, scope, text.decode(), mutated)
    return list(found.values())


def outwards(place: str) -> Iterator[str]:
    """A place (a file, a dot and a qualified name), the function or class around it,
    and so on to the file and folders."""
    while place:
        yield place
        place = place.rpartition("." if ".py." in place else "/")[0]


class Calls:
    """A plugin of pytest that writes a line for each test: its CPU time, and the
    functions of the project it calls."""

    def __init__(self, tree: Path, file: Path):
        self.tree = f"{tree}/"
        self.file = file

    def pytest_runtest_logstart(self, nodeid):
        self.codes = {}
        self.failed = False
        self.start = sum(os.times()[:4])
        threading.settrace(self.note)
        sys.settrace(self.note)

    def note(self, frame, *_):
        self.codes[id(frame.f_code)] = frame.f_code  # whose hash takes long

    def pytest_runtest_logreport(self, report):
        self.failed |= report.failed

    def pytest_runtest_logfinish(self, nodeid):
        sys.settrace(None)
        threading.settrace(None)
        seconds = round(sum(os.times()[:4]) - self.start, 3)
        calls = set()
        for code in self.codes.values():
            name = code.co_filename.removeprefix(self.tree)
            # Neither classes nor modules; of a lambda what is around it.
            if name.startswith(PACKAGES) and code.co_flags & inspect.CO_OPTIMIZED:
                calls.add(f"{name}.{code.co_qualname.partition('.<locals>.<')[0]}")
        if not self.failed:
            with self.file.open("a") as file:
                print(json.dumps([nodeid, seconds, sorted(calls)]), file=file)


class Watch:
    """The tests that watch a mutant, from a file that `Calls` wrote."""

    def __init__(self, file: Path, enough: float, tests: set[str]):
        """``enough`` is the CPU time in s that the tests of one mutant may take, and
        ``tests`` are those that there are."""
        self.enough = enough
        self.seconds = {}  # by test
        self.calling = collections.defaultdict(set)  # tests by place
        for line in file.open():
            test, seconds, calls = json.loads(line)
            if test in tests:
                self.seconds[test] = seconds
                for place in {place for call in calls for place in outwards(call)}:
                    self.calling[place].add(test)

    def over(self, m: Mutant) -> list[str]:
        """The tests to be run on a mutant, file by file, the quickest first."""
        if named := TABLE["tests"].get(m.file):
            near = {test for test in self.seconds if file_of(test) in named}
        else:
            places = outwards(f"{m.file}.{m.scope}".rstrip("."))
            near = next((self.calling[x] for x in places if x in self.calling), set())
        files = {file_of(test) for test in near}
        every = [test for test in self.seconds if file_of(test) in files]
        naming = files_that_name(m)
        every.sort(
            key=lambda test: (
                test not in near,
                test.partition("::")[0] not in naming,
                self.seconds[test],
            )
        )
        some = []
        sums = collections.Counter()
        for test in every:
            if sums.total() < self.enough:
                some.append(test)
                sums[file_of(test)] += self.seconds[test]
        return sorted(some, key=lambda test: (sums[file_of(test)], file_of(test)))


def files_that_name(m: Mutant) -> set[str]:
    """The files of tests that have the name of the constant that a mutant changes; none
    of a mutant within a function."""
    target = re.match(r"- (\w+)(?: *:[^=]*)? = ", m.change())
    if m.scope or not target:
        return set()
    name = re.compile(rf"\b{target[1]}\b")
    files = (ROOT / "tests").rglob("test_*.py")
    return {str(x.relative_to(ROOT)) for x in files if name.search(x.read_text())}


def file_of(test: str) -> str:
    """The name of a test's file, as the table has it; examples of docstrings are one
    file."""
    file = test.partition("::")[0]
    return (
        Path(file).stem.removeprefix("test_")
        if file.startswith("tests/")
        else "examples"
    )


def start(
    tree: Path,
    tests: list[str],
    seconds: float,
    *options: str,
    plugins=(),
    until_end: bool = False,
) -> int:
    """The id of a new process that runs some tests in a copy of the tree, with so much
    CPU time at most, up to the first file in which one fails, or all of them."""
    if child := os.fork():
        return child
    try:
        resource.setrlimit(resource.RLIMIT_CPU, (int(seconds),) * 2)
        resource.setrlimit(resource.RLIMIT_AS, (8 << 30,) * 2)
        signal.alarm(int(10 * seconds))  # for what sleeps
        os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
        os.dup2(1, 2)
        os.chdir(tree)
        os.environ["PYTHONPATH"] = sys.path[0] = str(tree)
        worst = 0
        for _, some in itertools.groupby(tests, file_of):  # each is read in its turn
            arguments = [*PYTEST, *options, *some]
            status = importlib.import_module("pytest").main(arguments, plugins)
            worst = worst or status
            if worst and not until_end:
                break
        os._exit(worst)
    finally:
        os._exit(1)


def copied(tree: Path) -> Path:
    """A copy of what git follows."""
    listed = subprocess.run(
        ["git", "ls-files", "-z"], cwd=ROOT, capture_output=True, check=True, text=True
    )
    for name in filter(None, listed.stdout.split("\0")):
        (tree / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(ROOT / name, tree / name)
    return tree


class Listed:
    """A plugin of pytest that writes which tests there are."""

    def __init__(self, file: Path):
        self.file = file
        file.write_text("")

    def pytest_collection_modifyitems(self, items):
        with self.file.open("a") as file:
            for item in items:
                print(item.nodeid, file=file)


def measure(file: Path, folder: Path, rooms: list[str]) -> None:
    """Write what each test calls, with a process for each file of tests."""
    tree = copied(folder / "0")
    file.write_text("")
    files = []
    for path in sorted(ROOT.glob("tests/*/test_*.py")):
        chosen = not rooms or path.parent.name in rooms
        if chosen and file_of(f"tests/{path.name}") not in TABLE["sources"]:
            files.append(path.relative_to(ROOT).as_posix())
    runs = [[file] for file in files]
    if not rooms:
        runs.append(list(PACKAGES))
    for some in runs:
        child = start(tree, some, 1200, plugins=[Calls(tree, file.absolute())])
        print(
            *some,
            "fails, or is skipped whole" if os.waitpid(child, 0)[1] else "",
            flush=True,
        )


class Failures(Listed):
    """A plugin of pytest that writes which tests fail."""

    def pytest_runtest_logreport(self, report):
        if report.failed:
            with self.file.open("a") as file:
                print(report.nodeid, file=file)

    def pytest_collection_modifyitems(self, items):
        pass


def started(tree: Path, tests: list[str], seconds: float, map_file: Path | None) -> int:
    """The id of a new process that runs the tests of a mutant: all of them for a
    map."""
    if map_file is None:
        return start(tree, tests, seconds, "-x")
    failures = Failures(tree / "failed.txt")
    return start(tree, tests, seconds, plugins=[failures], until_end=True)


def record(m: Mutant, tree: Path, map_file: Path) -> None:
    """Add the tests that notice a mutant to a map."""
    failed = sorted({*(tree / "failed.txt").read_text().splitlines()})
    with map_file.open("a") as file:
        print(json.dumps([f"{m.file}:{m.line}\n{m.change()}", failed]), file=file)


def needed(maps: list[Path], calls: Path) -> None:
    """Print tests that notice all mutants of some maps together, and those that are not
    needed for it."""
    seconds = {}
    for line in calls.open():
        test, seconds[test], _ = json.loads(line)
    noticed = {}
    for line in (line for path in maps for line in path.open()):
        change, tests = json.loads(line)
        if tests:
            noticed[change] = {*tests}
    left = {*noticed}
    chosen = []
    while left:
        gain = collections.Counter()
        for test in (test for change in left for test in noticed[change]):
            gain[test] += 1 / (0.01 + seconds.get(test, 0.0))
        best = max(gain, key=gain.get)
        chosen.append(best)
        left -= {change for change in left if best in noticed[change]}
    print(
        f"{len(noticed)} mutants are noticed by {len(chosen)} tests:", *chosen, sep="\n"
    )
    rest = sorted(seconds.keys() - {*chosen})
    print(f"\n{len(rest)} tests are not needed for it:", *rest, sep="\n")


def there_are(tree: Path) -> set[str]:
    """The tests of a copy of the tree."""
    listed = Listed(tree / "tests.txt")
    some = ["tests", *PACKAGES]
    os.waitpid(start(tree, some, 600, "--collect-only", plugins=[listed]), 0)
    return {*listed.file.read_text().splitlines()}


def hunted(
    some: list[Mutant], asked: argparse.Namespace, folder: Path
) -> Iterator[tuple[Mutant, str]]:
    """Each with "survived", "killed" or "time-out", so many at a time, each in a copy
    of the tree below ``folder``."""
    trees = [copied(folder / str(k)) for k in range(asked.jobs)]
    watch = Watch(asked.calls, asked.enough, there_are(trees[0]))
    running = {}
    todo = iter(some)
    while (m := next(todo, None)) or running:
        if m:
            tree, tests = trees.pop(), watch.over(m)
            (tree / m.file).write_text(m.mutated)
            seconds = 30 + 3 * sum(watch.seconds[x] for x in tests)
            running[started(tree, tests, seconds, asked.map)] = m, tree
        if not trees or not m:
            child, status = os.wait()
            done, tree = running.pop(child)
            (tree / done.file).write_text(done.source)
            if asked.map:
                record(done, tree, asked.map)
            trees.append(tree)
            late = os.WIFSIGNALED(status) and os.WTERMSIG(status) in (
                signal.SIGKILL,
                signal.SIGXCPU,
                signal.SIGALRM,
            )
            yield done, "time-out" if late else "killed" if status else "survived"


def report(asked: argparse.Namespace, folder: Path) -> None:
    every = []
    for path in sorted(p for top in PACKAGES for p in (ROOT / top).rglob("*.py")):
        file = path.relative_to(ROOT).as_posix()
        unwatched = file.startswith(tuple(TABLE["unwatched"]))
        if file.startswith(tuple(asked.only)) and not unwatched:
            every += mutants_of(path)
    count = min(asked.count, len(every))
    some = random.Random(asked.seed).sample(every, count)[asked.done :]
    print(f"{len(some)} of {len(every)} mutants, seed {asked.seed}", flush=True)
    known = {(x["file"], x["change"].strip()): x["why"] for x in TABLE["equivalent"]}
    counts = collections.Counter()
    for m, outcome in hunted(some, asked, folder):
        more = ""
        if outcome == "survived":
            more = m.change()
            if (m.file, more) in known:
                outcome = "no bug"
                more = known[m.file, more]
        counts[outcome] += 1
        print(f"{outcome:8} {m.file}:{m.line}\n{more}".rstrip(), flush=True)
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    told = ", ".join(f"{count} {outcome}" for outcome, count in sorted(counts.items()))
    print(f"\n{told}; {(used.ru_utime + used.ru_stime) / 60:.1f} minutes of CPU")


def main() -> None:
    ask = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    ask.add_argument("calls", type=Path, help="the file of what each test calls")
    ask.add_argument("--measure", action="store_true", help="write it")
    ask.add_argument("--count", type=int, default=200, help="how many, at random")
    ask.add_argument("--seed", type=int, default=1)
    ask.add_argument(
        "--done",
        type=int,
        default=0,
        help="so many of them are left out: a stopped run had them",
    )
    ask.add_argument("--jobs", type=int, default=2)
    ask.add_argument("--only", nargs="+", default=[""], help="beginnings of file names")
    ask.add_argument(
        "--enough",
        type=float,
        default=60.0,
        metavar="S",
        help="CPU time in s that the tests of one mutant may take",
    )
    ask.add_argument("--rooms", nargs="+", default=[], help="folders of tests/")
    ask.add_argument("--map", type=Path, help="add which tests notice each mutant")
    ask.add_argument("--needed", nargs="+", type=Path, help="read such maps")
    asked = ask.parse_args()
    if asked.needed:
        needed(asked.needed, asked.calls)
        return
    os.environ.update(CLEAN)
    signal.signal(signal.SIGTERM, signal.default_int_handler)  # clean up then too
    for name in HEAVY.split():
        importlib.import_module(name)
    with tempfile.TemporaryDirectory(prefix="mutants-") as folder:
        if asked.measure:
            measure(asked.calls, Path(folder), asked.rooms)
        else:
            report(asked, Path(folder))


if __name__ == "__main__":
    main()
