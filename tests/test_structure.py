"""The import rule: rft knows nothing of geomech; in geomech only the scene and what sits above it know rft."""

import ast
import pathlib

ROOT = pathlib.Path(__file__).parents[1]
SCENE_AND_ABOVE = {"scene.py", "scenes/__init__.py", "cli.py", "cost.py", "explain.py", "sweep.py"}


def imports(path):
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            yield from (alias.name.split(".")[0] for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.module:
            yield node.module.split(".")[0]


def test_rft_does_not_import_geomech():
    files = list((ROOT / "rft").rglob("*.py"))
    assert len(files) > 8
    assert [p.name for p in files if {"geomech", "figures"} & set(imports(p))] == []


def test_only_the_scene_joins_the_two():
    folder = ROOT / "geomech"
    users = {p.relative_to(folder).as_posix() for p in folder.rglob("*.py") if "rft" in set(imports(p))}
    assert users == SCENE_AND_ABOVE
