"""What `geomech run` leaves behind: figures, numbers and the scene, in one folder."""

from __future__ import annotations

import json
import math
import os
import re
from collections.abc import Callable, Iterable
from itertools import combinations
from pathlib import Path

import numpy as np

from geomech.core.errors import SceneError, named
from geomech.gaits import Butterfly, Circle, Gait
from geomech.io.files import read, refuse_inputs
from geomech.output import plots
from geomech.output.netcdf import save_connection
from geomech.run.cost import Cost
from geomech.scene.model import Scene
from geomech.scene.write import toml
from geomech.study import effort, tables, uncertainty
from geomech.study.bench import Study
from geomech.study.cost import Job, of_even_part, of_metric, of_planes, price
from geomech.study.cost import study as jobs
from geomech.systems import Swimmer
from geomech.systems.base import System, length_unit, refuse_singular, shape_labels
from geomech.systems.capabilities import near
from geomech.systems.framed import Framed
from geomech.tiers import TIERS
from geomech.tiers.area import AREA
from geomech.tiers.fitted import axes as field_axes
from geomech.tiers.fitted import is_too_large
from geomech.tiers.path import PATH

AMPLITUDES = 10  # or so, in the study that `run` makes of each gait
STEPS = (1.0, 2.0, 2.5, 5.0, 10.0)  # of round amplitudes, times a power of ten
ADDED = "not in the scene: added because Fig. 11(e) compares the two gaits of the three-link swimmer"
SCENE, TABLES = "scene.toml", "displacement.json"


def refuse_folder(scene: Scene, folder: Path, inputs: Iterable[Path]) -> None:
    """SceneError if the files of `write` would replace an input, or a scene that no `run` has left in ``folder``."""
    there = folder / SCENE
    refuse_inputs([there, folder / TABLES], inputs)
    if os.path.lexists(there) and not os.path.lexists(folder / TABLES) and not _holds(there, toml(scene)):
        raise SceneError(f"cannot write {there}: another scene stands there; choose another folder with -o")


def _holds(path: Path, text: str) -> bool:
    try:
        return read(path, 4 * len(text) + 4) == text.encode()
    except (OSError, ValueError):
        return False


def write(study: Study, folder: Path, progress: Callable) -> dict[str, dict]:
    """Compute everything and write it; returns the displacement tables by gait."""
    scene, gaits = study.scene, _gaits(study.scene)
    amplitudes = [reachable(scene, gait) for gait in gaits]
    mapped = is_mapped(scene.system)
    if mapped:
        study.compute_field(progress)
        save_connection(folder / "connection.nc", study)
    tables = {}
    for gait, some in zip(gaits, amplitudes):
        table = tables[type(gait).__name__.lower()] = study.study(some, study.methods, gait)
        if gait is not scene.gait:
            table["note"] = ADDED
    if mapped:
        _maps(study, folder, gaits)
    _save(plots.displacement_figure(tables, gaits), folder / "displacement")
    (folder / TABLES).write_text(json.dumps(tables, indent=1) + "\n")
    (folder / SCENE).write_text(toml(scene), encoding="utf-8")
    return tables


def is_mapped(system: System) -> bool:
    """Return whether there are pictures of all of shape space: of more joints there is `geomech ccf --pair`."""
    return {2: PATH, 3: AREA}[system.joints].is_offered(system) if system.joints in (2, 3) else False


def _maps(study: Study, folder: Path, gaits: list[Gait]) -> None:
    """Pictures of the connection and of the CCF, of three joints for every pair."""
    scene, labels = study.scene, shape_labels(study.scene.system)
    if scene.system.joints == 3:
        planes = [study.plane(pair) for pair in combinations(range(3), 2)]
        _save(plots.plane_connection_figure(planes, labels=labels), folder / "connection")
        _save(plots.planes_figure(planes, scene.gait, labels=labels), folder / "ccf")
        return
    _save(plots.connection_figure(study.fitted, labels=labels), folder / "connection")
    if isinstance(scene.system, Framed):
        _save(plots.frame_figure(scene.system.field.field, labels=labels), folder / "frame")
    maps = plots.ccf_figure(study.curvature, gaits, error=study.curvature_error, labels=labels)
    _save(maps, folder / "ccf")


def cost(scene: Scene) -> Cost:
    """Of `write`; SceneError, before anything is computed, for what it refuses."""
    study, system = Study(scene), scene.system
    found: list[Job] = []
    for k, gait in enumerate(_gaits(scene)):
        amplitudes = reachable(scene, gait)
        plans = {m: study.plan(m, gait, amplitudes) for m in study.methods}
        found += jobs(scene, plans, len(amplitudes), gait, tables=k == 0)
    if is_mapped(system):
        pairs = [*combinations(range(3), 2)] if system.joints == 3 else []
        found += of_even_part(scene) + of_planes(scene, pairs, [scene.gait.middle] * len(pairs))
        found += [] if effort.why_none(system) or effort.shared(system) else of_metric(scene)
    return price(found)


def _gaits(scene: Scene) -> list[Gait]:
    """The scene's own and, for the three-link swimmer, those of Fig. 11(e) beside it, at the same frequency."""
    three_link = isinstance(scene.system, Swimmer) and scene.system.three_link
    more = (Circle(reverse=True, frequency=scene.frequency), Butterfly(frequency=scene.frequency)) if three_link else ()
    return [scene.gait, *(g for g in more if type(g) is not type(scene.gait))]


def reachable(scene: Scene, gait: Gait) -> list[float]:
    """Round amplitudes (`steps`), of the sign of the gait's own, up to the largest that keeps it inside the field; where there
    is no field, or one with singular shapes, up to its own, which is the last.
    SceneError for a gait that does not move or lies outside."""
    system, n = scene.system, scene.numerics
    own = not PATH.is_offered(system) or system.traits.singularity is not None or is_too_large(system, n)
    unit = gait.unit(np.linspace(0, 2 * np.pi, 721))
    if np.ptp(unit, axis=0).max() == 0 or (own and gait.amplitude == 0):
        raise SceneError(f"{scene.name}: [gait] does not move: give it a size")
    if own:
        size = abs(gait.amplitude)
        if near(scene.system):
            return _near(scene, gait)
        found = [a for a in steps(size) if a < size * (1 - 1e-9)] + [size]
        return [float(np.copysign(a, gait.amplitude)) for a in found]
    room = min(min(a[-1] - x, x - a[0]) for a, x in zip(field_axes(scene.system, scene.numerics), gait.middle))
    if room <= 0:
        raise SceneError(f"{scene.name}: the gait's centre lies outside the field: raise [numerics] extent")
    return [float(np.copysign(a, gait.amplitude)) for a in steps(room / np.abs(unit).max())]


def _near(scene: Scene, gait: Gait) -> list[float]:
    """Amplitudes about the gait's own, as far as what is known of the system reaches; SceneError where that is nowhere."""
    found = [round(1 + 0.05 * k, 2) * gait.amplitude for k in range(-AMPLITUDES, AMPLITUDES + 1)]
    with named(scene.name):
        refuse_singular(scene.system, gait.cycle(scene.numerics.phases)[0])
    reached = lambda a: (scene.system.traits.singularity(gait.cycle(scene.numerics.phases, a)[0]) >= 0).all()
    return [a for a in found if reached(a)]


def steps(top: float) -> list[float]:
    """Multiples of a round number, about AMPLITUDES of them, up to ``top``."""
    wanted = top / AMPLITUDES
    power = 10.0 ** np.floor(np.log10(wanted))
    step = min(STEPS, key=lambda s: abs(np.log(s * power / wanted))) * power
    count = int(top / step * (1 + 1e-12))
    return [float(f"{k * step:.10g}") for k in range(1, count + 1)]


def _save(fig, stem: Path) -> None:
    plots.save(fig, *(stem.with_suffix(ending) for ending in (".png", ".pdf")))


def text_table(title: str, table: dict, scene: Scene) -> str:
    """x, y, heading and net distance per cycle by tier, each with its error in its own unit, as plain text."""
    tiers = [m for m in table if m in TIERS]
    length, unit = scene.system.length, length_unit(scene.system)
    lines = [f"{title}: {table['note']}"] if "note" in table else []
    for quantity, headline, by, places in _blocks(table, length, unit):
        lines.append(f"{title}: {headline}")
        medium = np.array(table["medium_error_of"][quantity]) * by if "medium_error_of" in table else None
        lines.append("amplitude" + "".join(f"{m:>{places + 15}}" for m in tiers) + "     medium" * (medium is not None))
        values = [np.round(by * tables.of_pose(table[m])[quantity], places) + 0.0 for m in tiers]  # no -0.000
        errors = [by * tables.error_of(table, quantity, m) for m in tiers]
        shifts = _shifts(table, quantity, length) if medium is not None else ()
        for k, a in enumerate(table["amplitude"]):
            row = (f"{x[k]:{places + 6}.{places}f} +-{e[k]:7.1e}" for x, e in zip(values, errors))
            lines.append(f"{a:9.6g}" + "".join(row) + (f"  +-{medium[k]:7.1e}" if medium is not None else ""))
            lines[-1] += f"  mean {by * shifts[k]:+.1e}" if k in shifts else ""
    if "medium_error_rule" in table:
        rules = sorted({*table["medium_error_rule"]})
        lines.append(
            f"medium: one standard deviation by its covariance, carried on by {' and '.join(rules)} propagation"
        )
        if any("  mean " in line for line in lines):
            lines.append(
                "mean: how far the mean over the media of that covariance lies from the displacement in their mean"
            )
    lines += _surfaces(table, scene)
    lines += _effort(title, table, tiers)
    amplitude = re.sub(r"[$\\]", "", table["units"]["amplitude"])
    lines.append(f"amplitude: {amplitude}; x, y, heading: the pose after a cycle, in the frame at its start")
    if "estimate_is" in table:
        lines.append(f"estimated error: {table['estimate_is']}")
    return "\n".join([*lines, _times(table), ""])


def _shifts(table: dict, quantity: str, length: float) -> dict[int, float]:
    """By the numbers of amplitudes at which it matters: how far an uncertain medium shifts the mean of a quantity."""
    least = uncertainty.SEEN * (1.0 if quantity == "heading" else length)
    both = zip(table["medium_shift_of"][quantity], table["medium_error_of"][quantity])
    return {k: x for k, (x, sd) in enumerate(both) if abs(x) > max(uncertainty.SHIFTED * sd, least)}


def _surfaces(table: dict, scene: Scene) -> list[str]:
    """How far tiers hang on the surface that a loop of three and more joints spans."""
    lines = []
    for m, spread in table.get("surface_spread", {}).items():
        lines.append(
            f"{m}: over a cone from the loop's mean shape; other surfaces that it spans differ by, which is in the error,"
        )
        lines.append(f"amplitude position ({length_unit(scene.system)})  heading (rad)")
        turned = table["surface_spread_heading"][m]
        rows = zip(table["amplitude"], spread, turned)
        lines += [f"{a:9.6g} {x:13.1e} {t:14.1e}" for a, x, t in rows]
    return lines


def _effort(title: str, table: dict, tiers: list[str]) -> list[str]:
    """Path length and work, and the cost of transport by tier, if they were asked for."""
    if "work" not in table:
        return []
    told = lambda x, form: f"{'-' if x is None else format(x, form):>12}"
    lines = [
        f"{title}: path length and work of a cycle, and cost of transport: work over that of towing the body as far"
    ]
    lines.append("amplitude path length        work" + "".join(f"{m:>12}" for m in tiers))
    for k, a in enumerate(table["amplitude"]):
        row = [told(table[key][k], ".6f") for key in ("path_length", "work")]
        lines.append(f"{a:9.6g}" + "".join(row + [told(table["cost_of_transport"][m][k], ".4g") for m in tiers]))
    said = [
        f"{key.replace('_', ' ')}: {table['units'][key]}" for key in ("path_length", "work") if key in table["units"]
    ]
    return [*lines, "; ".join(said)]


def _blocks(table: dict, length: float, unit: str):
    """(quantity, headline, factor, decimals) of the parts of a table, each of one unit; the last digit of a length is a
    millionth of the body's."""
    decimals = 6 - min(0, math.floor(math.log10(length) + 1e-9))
    moved = f"displacement per cycle ({unit}) +- estimated error"
    yield "net_distance", f"{moved}: net distance, sqrt(x^2 + y^2)", 1.0, decimals
    yield "x", f"{moved}: x", 1.0, decimals
    yield "y", f"{moved}: y", 1.0, decimals
    yield "heading", "heading gained (rad) +- estimated error", 1.0, 6
    if (f := table.get("frequency")) is not None:
        speed = lambda u: f"speed ({u}/s) at {f:g} Hz +- estimated error: net distance times frequency"
        if unit != "BL":
            yield "net_distance", speed(unit), f, decimals
        yield "net_distance", speed("BL"), f / length, 6


def _times(table: dict) -> str:
    """What tables took to build and tiers to look up, in words."""
    kept = table.get("kept", ())
    told = [f"{name} {took:.3g}{' (built before)' * (name in kept)}" for name, took in table["seconds"].items()]
    return f"seconds: {', '.join(told)}{' with the search for it' * ('tier' in table)}"
