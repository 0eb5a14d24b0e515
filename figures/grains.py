"""What beds of grains say about resistive force theory: a swimmer's speed, lift on bars, and drag after a reversal.

Spheres of 6 mm with friction 0.3 and 1 MPa, in beds that differ by their seeds; error bars are standard errors over beds.

Left: displacement of a three-link swimmer, 162 x 12 mm at 25 mm depth, on circles, beside the direct tier with the law of
its flank and its end caps, both measured in the same grains (band: one standard deviation of the law), the same without the
caps, and the law of a short rod with its ends in it. Middle: lift over drag on bars without ends, beside the nine-term map,
as it is and without tension. Right: drag on the flank of a rod after its second reversal over that after a long way, in grains
(dots) and by the law of the effect `transient` (lines), fitted at 20 mm alone: 10 and 40 mm are predicted.

Size, depth and friction of the robot of Fig. 11(e) are not in the paper's text, so that this is no copy of it. The data are
in `figures/campaigns`; the commands that made them stand in the files.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from figures import main, style
from figures.campaigns import grains
from figures.fig08a_rods import rod_forces
from geomech import plots
from geomech.scenes import load
from geomech.studies.calibration import Calibration
from geomech.studies.study import Study
from rft import EndCaps
from rft.grains.reversal import Recovery, recovery
from rft.plates import VERTICAL, HalfCylinder, RoundRod

RADIUS, SIZE = 6e-3, 0.162  # m, of the swimmer
AMPLITUDES = np.linspace(0.25, 2.1, 14)
BARS = {  # by their names in the data
    "round": RoundRod(grains.BAR, 0.1),
    "half round": HalfCylinder(grains.BAR, 0.1, "down"),
    "half round, flat up": HalfCylinder(grains.BAR, 0.1, "up"),
}


def compute(amplitudes=AMPLITUDES) -> dict:
    """Return curves and measured numbers.

    "amplitude": (A,), rad. "curves": by name {"distance", "spread": (A,), BL}. "swims": {"amplitude", "distance", "error":
    (S,)}. "lift": by shape {"grains", "error", "keep", "cut"}, lift over drag. "reversal": by (depth, m, angle
    from the axis, degrees) and "flank" or "ends" {"plateau", "at_once", "travel", "start", "rms": (mean, error)} of
    `rft.grains.reversal.Recovery`, by all amplitudes together. "ways": by (amplitude, m, angle) {"travel" since the second
    reversal, m, "grains", "law"}, shares of the plateau, 24.5 mm deep."""
    flank = Calibration("flank-drag", end_caps="fitted").ask().subject
    short = Calibration("short-rod-drag").ask().subject
    caps = (EndCaps(RADIUS / SIZE, flank.end_caps / 2, flank.end_caps / 2),)
    laws = {
        "flank and ends": (flank.medium, caps),
        "flank alone": (flank.medium, ()),
        "short rod": (short.medium, ()),
    }
    return {
        "amplitude": np.asarray(amplitudes),
        "curves": {name: predicted(*law, amplitudes) for name, law in laws.items()},
        "swims": measured_swims(),
        "lift": {name: lifts(name, rod) for name, rod in BARS.items()},
        "reversal": measured_reversals(),
        "ways": ways(),
    }


def predicted(medium, effects, amplitudes) -> dict:
    """Return distances of circles by the direct tier, and their spread by the medium, body lengths."""
    scene = load("three-link-glass")
    scene = scene.changed(system=replace(scene.system, medium=medium, effects=effects))
    net = Study(scene).study(list(amplitudes), ("direct",)).result["net_distance"]
    return {"distance": net.values[0], "spread": net.spread[0]}


def over_beds(values: np.ndarray, beds: np.ndarray) -> tuple[float, float]:
    """Return the mean over beds of their means, and its standard error; nan of one bed."""
    means = np.array([values[beds == bed].mean() for bed in np.unique(beds)])
    return float(means.mean()), float(means.std(ddof=1) / np.sqrt(len(means))) if len(means) > 1 else np.nan


def measured_swims() -> dict:
    data = grains.read("swims")
    distance, amplitude = np.hypot(data["x_BL"], data["y_BL"]), data["amplitude"]
    rows = [(a, *over_beds(distance[amplitude == a], data["bed"][amplitude == a])) for a in np.unique(amplitude)]
    return dict(zip(("amplitude", "distance", "error"), np.array(rows).T))


def lifts(name: str, bar) -> dict:
    """Return lift over drag of a bar in grains and by the nine-term map, as it is and without tension, deep down."""
    data = grains.read("lift")
    mine = data["shape"] == name
    value, error = over_beds(data["lift_over_drag"][mine], data["bed"][mine])
    stress = VERTICAL["glass-3mm"].stress
    by_map = {t: rod_forces(replace(stress, tension=t), bar.outline(200), 2)["ratio"] for t in ("keep", "cut")}
    return {"grains": value, "error": error, **by_map}


def reversal_cases(depth: float, angle: float, part: str, beds=grains.BEDS, amplitudes=None) -> list[tuple]:
    """Return (amplitude, travel, drag) of all ways at a depth, m, and an angle, degrees; means over beds."""
    data = grains.read("reversals")
    mine = (data["depth_m"] == depth) & (data["angle_deg"] == angle)
    found = []
    for a in np.unique(data["amplitude_m"][mine]) if amplitudes is None else amplitudes:
        rows = [mine & (data["amplitude_m"] == a) & (data["bed"] == bed) for bed in beds]
        drag = np.mean([data[f"{part}_N"][r] for r in rows], 0)
        found.append((float(a), data["travel_m"][rows[0]], drag))
    return found


def measured_reversals() -> dict:
    found = {}
    for depth, angle in dict.fromkeys((depth, angle) for _, depth, angle in grains.STROKES):
        for part in ("flank", "ends"):
            fits = np.array([recovery(reversal_cases(depth, angle, part, (bed,))) for bed in grains.BEDS])
            pairs = zip(fits.mean(0).tolist(), (fits.std(0, ddof=1) / np.sqrt(len(fits))).tolist())
            found[depth, angle, part] = dict(zip(Recovery._fields, pairs))
    return found


def ways(depth: float = 0.0245, fitted: float = 0.02) -> dict:
    """Return drags after the second reversal, and the law fitted at one amplitude, m, alone."""
    found = {}
    for angle in (90.0, 0.0):
        law = recovery(reversal_cases(depth, angle, "flank", amplitudes=(fitted,)))
        for a, travel, drag in reversal_cases(depth, angle, "flank"):
            late = travel > 3 * a
            pair = drag[late] / law.plateau, law.drag(travel, a)[late] / law.plateau
            found[a, angle] = {"travel": travel[late] - 3 * a, **dict(zip(("grains", "law"), pair))}
    return found


def table(numbers: dict) -> str:
    """Return the measured displacements beside the curves, and lift over drag."""
    swims, at = numbers["swims"], numbers["amplitude"]
    by_curve = [np.interp(swims["amplitude"], at, c["distance"]) for c in numbers["curves"].values()]
    rows = [
        (
            f"{a:.2f} rad",
            f"{d:.3f} +- {e:.3f}",
            *(f"{c[k]:.3f}" for c in by_curve),
        )
        for k, (a, d, e) in enumerate(zip(*swims.values()))
    ]
    lines = style.table(("BL per cycle", "grains", *numbers["curves"]), rows)
    rows = [
        (name, f"{x['grains']:+.2f} +- {x['error']:.2f}", f"{x['keep']:+.2f}", f"{x['cut']:+.2f}")
        for name, x in numbers["lift"].items()
    ]
    lifted = style.table(("lift over drag", "grains", "map", "tension cut"), rows)
    rows = [
        (
            f"{part} {'across' if angle else 'along'}, {1e3 * depth:.3g} mm deep",
            *("{:.2f} +- {:.2f}".format(*x[key]) for key in ("plateau", "at_once")),
            "{:.0f} +- {:.0f} mm".format(*(1e3 * np.array(x["travel"]))),
        )
        for (depth, angle, part), x in numbers["reversal"].items()
    ]
    back = style.table(("drag after a reversal", "plateau, N", "at once", "95 % after"), rows)
    return f"{lines}\n{lifted}\n{back}"


@plots.styled
def draw(numbers: dict):
    fig, axes = plots.figure(9.6, 3.0, 3)
    left, middle, right = axes[0]
    for (name, curve), colour in zip(numbers["curves"].items(), (style.VERMILION, style.BLUE, "0.5")):
        x, d, s = numbers["amplitude"], curve["distance"], curve["spread"]
        left.fill_between(x, d - s, d + s, color=colour, alpha=0.2, lw=0)
        left.plot(x, d, color=colour, label=name)
    swims = numbers["swims"]
    dots = {"color": "black", "ls": "none", "marker": "o", "ms": 4, "capsize": 2}
    left.errorbar(swims["amplitude"], swims["distance"], np.nan_to_num(swims["error"]), label="grains", **dots)
    left.set(xlabel="amplitude of the circle (rad)", ylabel="distance per cycle (BL)", ylim=(0, 0.36))
    left.legend(loc="upper left", ncols=2)
    lift = numbers["lift"]
    y = np.arange(len(lift))
    for key, marker, label in (("keep", "D", "nine-term map"), ("cut", "s", "tension cut")):
        middle.plot([x[key] for x in lift.values()], y, marker, mfc="white", color=style.BLUE, label=label)
    errors = np.nan_to_num([x["error"] for x in lift.values()])
    middle.errorbar([x["grains"] for x in lift.values()], y, xerr=errors, label="grains", **dots)
    middle.axvline(0.0, **style.GUIDE)
    middle.set_yticks(y, list(lift))
    middle.set(xlabel="lift over drag", ylim=(len(lift) - 0.5, -1.2))
    middle.legend(loc="upper right", ncols=1)
    for (a, angle), way in numbers["ways"].items():
        if angle or a == 0.02:
            colour = style.SEQUENCE[(0.01, 0.02, 0.04).index(a)] if angle else "0.5"
            x, label = 1e3 * way["travel"], f"{1e3 * a:g} mm {'across' if angle else 'along'}"
            right.plot(x, way["grains"], ".", ms=3, color=colour)
            right.plot(x, way["law"], color=colour, label=label)
    right.set(xlabel="travel since the reversal (mm)", ylabel="drag over that after a long way", xlim=(0, 80))
    right.set(ylim=(0, 1.3))
    right.legend(loc="lower right")
    return fig


if __name__ == "__main__":
    main("grains", compute, draw, table)
