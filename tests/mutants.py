"""Small bugs put into the code on purpose, to see whether a test notices. By hand, not collected by pytest:

    python tests/mutants.py --count 200 --seed 1 --jobs 2 [--only rft/loads.py rft/bodies]

`mutants.toml` beside this file says which tests watch a module, what is left out and which mutants are no bugs. Mutants
live in copies of the tree in the system's temporary folder, one a worker; the checkout is only read. A mutant is killed
when a test fails; time-outs, far longer than without it, are counted apart. Survivors are printed as what they change.
`--done 50` goes on with a run that was stopped after 50.
"""

import argparse
import ast
import collections
import copy
import difflib
import importlib
import importlib.util
import os
import random
import resource
import runpy
import shutil
import signal
import sys
import tempfile
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).parents[1]
TABLE = tomllib.loads((ROOT / "tests/mutants.toml").read_text())
# In one process and without time limits of its own, whatever the suite's settings are.
PYTEST = ["-qx", "--assert=plain", "--hypothesis-seed=0", "-p", "no:cacheprovider"]
PYTEST += ["-o", "addopts=", "-o", "timeout=0", "-m", "not soak and not benchmark"]
# Loaded once, before each mutant's process splits off.
HEAVY = "pytest numpy scipy.interpolate scipy.special scipy.stats sympy mpmath hypothesis.strategies matplotlib.pyplot xarray"
CLEAN = {"PYTHONDONTWRITEBYTECODE": "1", "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1", "MPLBACKEND": "agg"}

SWAPPED = {ast.Add: ast.Sub, ast.Sub: ast.Add, ast.Mult: ast.Div, ast.Div: ast.Mult, ast.Pow: ast.Mult}
SWAPPED |= {ast.FloorDiv: ast.Mult, ast.Mod: ast.FloorDiv, ast.BitAnd: ast.BitOr, ast.BitOr: ast.BitAnd}
BORDER = {ast.Lt: ast.LtE, ast.LtE: ast.Lt, ast.Gt: ast.GtE, ast.GtE: ast.Gt}
OPPOSITE = {ast.Lt: ast.GtE, ast.LtE: ast.Gt, ast.Gt: ast.LtE, ast.GtE: ast.Lt, ast.Eq: ast.NotEq, ast.NotEq: ast.Eq}
OPPOSITE |= {ast.Is: ast.IsNot, ast.IsNot: ast.Is, ast.In: ast.NotIn, ast.NotIn: ast.In}
PAIRS = "minimum maximum, min max, sin cos, real imag, any all, zeros ones, zeros_like ones_like, floor ceil, sum mean"
TWIN = {p[i]: p[1 - i] for p in map(str.split, (PAIRS + ", argmin argmax, exp expm1").split(",")) for i in (0, 1)}
EITHER_WAY = {
    "max",
    "min",
    "maximum",
    "minimum",
    "fmax",
    "fmin",
    "hypot",
    "distance",
    "pose_distance",
    "dot",
    "plus",
}  # of two arguments


class Mutant(NamedTuple):
    file: str
    line: int
    source: str  # of the whole file
    mutated: str

    def change(self) -> str:
        """The lines taken away (-) and put in (+)."""
        lines = difflib.unified_diff(self.source.splitlines(), self.mutated.splitlines(), n=0, lineterm="")
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
                others = [table[type(op)]() for table in (BORDER, OPPOSITE) if type(op) in table]
                yield from (with_(ops=[*ops[:k], other, *ops[k + 1 :]]) for other in others)
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
            yield from (with_(keywords=[*given[:k], *given[k + 1 :]]) for k in range(len(given)))
            either_way = len(args) == 2 and ast.unparse(node.func).rpartition(".")[2] in EITHER_WAY
            told_apart = len({*map(ast.dump, args[:2])}) == 2 and not any(isinstance(x, ast.Starred) for x in args[:2])
            if told_apart and not either_way:
                yield with_(args=[args[1], args[0], *args[2:]])
        case ast.If(test=test) | ast.IfExp(test=test):
            yield test, ast.UnaryOp(ast.Not(), test)
        case ast.Return(value=ast.BinOp() | ast.UnaryOp() | ast.Call() as value):
            yield value, ast.UnaryOp(ast.USub(), value)
        case ast.AugAssign() | ast.Raise() | ast.Expr(value=ast.Call()) | ast.Assign(targets=[ast.Subscript()]):
            yield node, ast.Pass()


def nodes(tree):
    """The nodes of a tree that may be mutated: not texts, annotations, decorators, nor what the table says to skip."""
    for field, value in ast.iter_fields(tree):
        for node in value if isinstance(value, list) else [value]:
            plain = isinstance(node, ast.AST) and field not in ("annotation", "returns", "decorator_list")
            name = ast.unparse(node.targets[0]) if isinstance(node, ast.Assign) else getattr(node, "name", None)
            if plain and name not in TABLE["skip"] and not isinstance(node, ast.JoinedStr):
                yield node
                yield from () if isinstance(node, ast.Raise) else nodes(node)


def mutants_of(path: Path) -> list[Mutant]:
    file, text = path.relative_to(ROOT).as_posix(), path.read_bytes()
    starts = [0, *(i + 1 for i, byte in enumerate(text) if byte == 10)]
    tree, found = ast.parse(text), {}
    for part, new in (v for node in nodes(tree) for v in variants(node)):
        low, high = starts[part.lineno - 1] + part.col_offset, starts[part.end_lineno - 1] + part.end_col_offset
        code = ast.unparse(ast.fix_missing_locations(new))
        bare = isinstance(new, (ast.stmt, ast.Name)) or (isinstance(new, ast.Constant) and "-" not in code)
        mutated = (text[:low] + (code if bare else f"({code})").encode() + text[high:]).decode()
        found[mutated] = Mutant(file, part.lineno, text.decode(), mutated)
    return list(found.values())


def watch(file: str) -> list[str] | None:
    """The tests that watch a file, of the longest entry in the table with which it begins; None if it has none."""
    keys = [key for key in TABLE["tests"] if file.startswith(key)]
    return TABLE["tests"][max(keys, key=len)] if keys else None


def start(tree: Path, tests: list[str], seconds: float) -> int:
    """The id of a new process that runs some test files in a copy of the tree, with so much CPU time at most."""
    if child := os.fork():
        return child
    try:
        os.nice(10)
        resource.setrlimit(resource.RLIMIT_CPU, (int(seconds),) * 2)
        resource.setrlimit(resource.RLIMIT_AS, (8 << 30,) * 2)
        signal.alarm(int(10 * seconds))  # for what sleeps
        os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
        os.dup2(1, 2)
        os.chdir(tree)
        os.environ["PYTHONPATH"] = sys.path[0] = str(tree)
        if "backend" in tests and importlib.util.find_spec("numba"):  # else they are skipped
            runpy.run_module("rft")
        slow = [f"--deselect=tests/test_{name}.py::test_{x}" for name in tests for x in TABLE["slow"].get(name, ())]
        os._exit(importlib.import_module("pytest").main([*PYTEST, *slow, *(f"tests/test_{x}.py" for x in tests)]))
    finally:
        os._exit(1)


def hunted(some: list[Mutant], folder: Path, jobs: int) -> Iterator[tuple[Mutant, str]]:
    """Each with "survived", "killed" or "time-out", so many at a time, each in a copy of the tree below ``folder``."""
    trees = [folder / str(k) for k in range(jobs)]
    for tree in trees:
        shutil.copytree(
            ROOT,
            tree,
            ignore=shutil.ignore_patterns(".git", ".venv", ".*_cache", "__pycache__", "build", "*.egg-info", "results"),
        )
    usual, running = {}, {}
    for name in sorted({name for m in some for name in watch(m.file)}):
        _, status, used = os.wait4(start(trees[0], [name], 600), 0)
        if status:
            sys.exit(f"tests/test_{name}.py does not pass as it is, or is skipped whole")
        usual[name] = used.ru_utime + used.ru_stime
    todo = iter(some)
    while (m := next(todo, None)) or running:
        if m:
            tree = trees.pop()
            (tree / m.file).write_text(m.mutated)
            running[start(tree, watch(m.file), 10 + 3 * sum(usual[x] for x in watch(m.file)))] = m, tree
        if not trees or not m:
            child, status = os.wait()
            done, tree = running.pop(child)
            (tree / done.file).write_text(done.source)
            trees.append(tree)
            yield done, "time-out" if os.WIFSIGNALED(status) else "killed" if status else "survived"


def main() -> None:
    ask = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    ask.add_argument("--count", type=int, default=200, help="how many, at random")
    ask.add_argument("--seed", type=int, default=1)
    ask.add_argument("--done", type=int, default=0, help="so many of them are left out: a stopped run had them")
    ask.add_argument("--jobs", type=int, default=2)
    ask.add_argument("--only", nargs="+", default=[""], help="beginnings of file names")
    asked = ask.parse_args()
    files = sorted(p.relative_to(ROOT).as_posix() for top in ("rft", "geomech") for p in (ROOT / top).rglob("*.py"))
    every = [m for f in files if watch(f) and f.startswith(tuple(asked.only)) for m in mutants_of(ROOT / f)]
    some = random.Random(asked.seed).sample(every, min(asked.count, len(every)))[asked.done :]
    print(f"{len(some)} of {len(every)} mutants, seed {asked.seed}", flush=True)
    os.environ.update(CLEAN)
    signal.signal(signal.SIGTERM, signal.default_int_handler)  # clean up then too
    for name in HEAVY.split():
        importlib.import_module(name)
    known = {(x["file"], x["change"].strip()): x["why"] for x in TABLE.get("equivalent", ())}
    counts = collections.Counter()
    with tempfile.TemporaryDirectory(prefix="mutants-") as folder:
        for m, outcome in hunted(some, Path(folder), asked.jobs):
            why = known.get((m.file, m.change())) if outcome == "survived" else None
            counts["no bug" if why else outcome] += 1
            more = f" no bug: {why}" if why else f"\n{m.change()}" if outcome == "survived" else ""
            print(f"{outcome:8} {m.file}:{m.line}{more}", flush=True)
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    told = ", ".join(f"{count} {outcome}" for outcome, count in sorted(counts.items()))
    print(f"\n{told}; {(used.ru_utime + used.ru_stime) / 60:.1f} minutes of CPU")


if __name__ == "__main__":
    main()
