"""The import rules: rft knows nothing of geomech; of rft the pure geometry knows planar motions alone."""

import ast
import pathlib

ROOT = pathlib.Path(__file__).parents[1]
KNOW_MECHANICS = {"scene/model.py", "scene/read.py", "cli.py", "study/cost.py", "study/sweep.py", "output/explain.py"}


def imports(path):
    """Dotted names of all that a file imports, wherever in it."""
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.module:
            yield from (f"{node.module}.{alias.name}" for alias in node.names)


def test_rft_does_not_import_geomech():
    files = list((ROOT / "rft").rglob("*.py"))
    assert len(files) > 8
    assert [p.name for p in files if {"geomech", "figures"} & {x.partition(".")[0] for x in imports(p)}] == []


def test_pure_geometry_knows_planar_motions_alone():
    folder = ROOT / "geomech"
    users = {
        p.relative_to(folder).as_posix()
        for p in folder.rglob("*.py")
        if any(x.partition(".")[0] == "rft" and not x.startswith("rft.se2") for x in imports(p))
    }
    assert users == KNOW_MECHANICS
