"""The figures of `figures/`: every script with its picture."""

from __future__ import annotations

import ast
import os
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parents[2]
DRAWN = ROOT / ".docs" / "generated" / "figures"
GROUPS = {  # by physics; a script that is not here is found by the build
    "Force laws": ["fig05c_force_law", "fig06b_plate_stress", "fig07_stress_maps"],
    "Swimmers of three links": [
        "fig11c_connection", "fig11d_ccf", "fig11e_displacement", "grains", "readme", "filmstrip", "frames_area", "kinks",
        "optimal_gaits", "measured_gait",
    ],
    "Animals": ["fig09c_efficiency", "fig10_neuromechanics", "transients", "midlines"],
    "Legs, rods and bodies in grains": ["fig08a_rods", "grain_plates", "fig08b_legs", "ground_effects", "meshes"],
    "Robots": ["fig12_walking", "walking_mujoco", "walking_sensitivity", "walking_steps", "wheel", "screws", "sand_gaits"],
    "Accuracy and cost": ["work_precision", "cost_scaling", "effects_cost"],
}  # fmt: skip
PICTURES = {  # of scripts whose committed picture has a shorter name
    "fig06b_plate_stress": "fig06b", "fig07_stress_maps": "fig07", "fig08a_rods": "fig08a", "fig08b_legs": "fig08b",
    "fig09c_efficiency": "fig09c", "fig10_neuromechanics": "fig10", "fig12_walking": "fig12", "measured_gait": "measured",
}  # fmt: skip


def draw_missing() -> None:
    """Draw the figures of which the repository has no picture."""
    DRAWN.mkdir(parents=True, exist_ok=True)
    for name in scripts():
        if not _committed(name).exists():
            target = DRAWN / f"{name}.png"
            if (
                not target.exists()
                or target.stat().st_mtime
                < (ROOT / "figures" / f"{name}.py").stat().st_mtime
            ):
                env = {**os.environ, "PYTHONPATH": str(ROOT)}
                command = [sys.executable, "-m", f"figures.{name}", str(target)]
                subprocess.run(
                    command, check=True, cwd=ROOT, env=env, stdout=subprocess.DEVNULL
                )


def scripts() -> list[str]:
    """Return the names of all scripts that draw a figure, those of no group last."""
    found = {path.stem for path in (ROOT / "figures").glob("*.py")} - {
        "__init__",
        "style",
    }
    grouped = [name for names in GROUPS.values() for name in names]
    return [name for name in grouped if name in found] + sorted(found - {*grouped})


def page() -> str:
    """Return a section for each group, with title, text, picture and command of every figure."""
    rest = [
        name
        for name in scripts()
        if not any(name in names for names in GROUPS.values())
    ]
    groups = {**GROUPS, **({"Others": rest} if rest else {})}
    return "\n\n".join(
        [
            f"## {title}\n\n" + "\n\n".join(map(_figure, names))
            for title, names in groups.items()
        ]
    )


def _committed(name: str) -> Path:
    return ROOT / "figures" / f"{PICTURES.get(name, name)}.png"


def _figure(name: str) -> str:
    text = ast.get_docstring(
        ast.parse((ROOT / "figures" / f"{name}.py").read_text(encoding="utf-8"))
    )
    title, _, about = " ".join(text.partition("\n\n")[0].split()).partition(": ")
    about = about[:1].upper() + about[1:]
    picture = _committed(name)
    target = (
        f"../../figures/{picture.name}"
        if picture.exists()
        else f"/generated/figures/{name}.png"
    )
    alt = title.replace("[", "(").replace("]", ")")
    return f"### {title.rstrip('.')}\n\n{about}\n\n![{alt}]({target})\n\n```sh\npython -m figures.{name}\n```"
