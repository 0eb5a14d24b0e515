"""What beds of grains say about resistive force theory: swimmers, lift on bars, and
drag after a reversal.

Spheres of 6 mm with friction 0.3 and 1 MPa, in beds that differ by their seeds; error
bars are standard errors over beds.

(a) Displacement of three links, 162 x 12 mm at 25 mm depth, on circles, beside the
tiers with the law of its flank and its ends, both measured in the same grains (band:
one standard deviation of the flank's law): with ends whose axial force falls with the
angle as on rods, with flat ends, and with a transient over two travels. (b) The same
for the butterfly and a wave on seven links. (c) Lift over drag on bars without ends,
beside the nine-term map, as it is and without tension. (d) Drag on the flank of a rod
after its second reversal over that after a long way, in grains (dots) and by the law of
the effect `transient` (lines), fitted at 20 mm alone: 10 and 40 mm are predicted.

Size, depth and friction of the robot of Fig. 11(e) are not in the paper's text, so that
this is no copy of it. The data are in `figures/grains/campaigns`; the commands that made them
stand in the files.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from figures import main, style
from figures.grains.campaigns import grains
from figures.paper.fig08a_rods import rod_forces
from geomech import plots
from geomech.scenes import load
from geomech.studies.scene_tables import SceneTables
from geomech.studies.terradynamics.calibration import rod_fit
from rft import EndCaps, Transient
from rft.grains.reversal import Recovery, recovery
from rft.terradynamics.plates import VERTICAL, HalfCylinder, RoundRod

# m, of the swimmer
RADIUS = 6e-3
SIZE = 0.162
AMPLITUDES = np.linspace(0.25, 2.1, 14)
TIERS = "area", "harmonic", "direct"
# Travels of the transient, body lengths: as the flank's drag comes back in these swims,
# and as on a rod to and fro.
TRAVELS = 0.05, 0.21
OTHERS = (
    (grains.BUTTERFLY, 1.0),
    (grains.WAVE, 0.5),
    (grains.WAVE, 0.87),
    (grains.WAVE, 1.2),
)
# e of both, fitted to the same rods
FLAT = "direct, flat ends"
FLAT_ENDS = 1.71
BARS = {  # by their names in the data
    "round": RoundRod(grains.BAR, 0.1),
    "half round": HalfCylinder(grains.BAR, 0.1, "down"),
    "half round, flat up": HalfCylinder(grains.BAR, 0.1, "up"),
}


def compute(amplitudes=AMPLITUDES, others=OTHERS, travels=TRAVELS) -> dict:
    """Return predicted and measured numbers.

    "amplitude": (A,), rad. "curves": by name {"distance", "spread": (A,), BL} of
    circles, spread only of the law. "others": by scene and amplitude, by name distances
    and spread (float, float). "swims": by scene, amplitude, rad, and frequency, Hz,
    (distance, error), BL. "lift": by shape {"grains", "error", "keep", "cut"}, lift
    over drag. "reversal": by (depth, m, angle from the axis, degrees) and "flank" or
    "ends" {"plateau", "at_once", "travel", "start", "rms": (mean, error)} of
    `rft.grains.reversal.Recovery`, by all amplitudes together. "stretches": by
    (amplitude, m, depth, m, angle) (mean, error) of the share of the flank's late drag
    that is there at once after the second reversal, and of the travel, m, to 95 % of
    it. "ways": by (amplitude, m, angle) {"travel" since the second reversal, m,
    "grains", "law"}, shares of the plateau, 24.5 mm deep."""
    found = {case: predicted(case[0], [case[1]], travels) for case in others}
    return {
        "amplitude": np.asarray(amplitudes),
        "curves": predicted(grains.CIRCLE, amplitudes, travels),
        "others": {
            case: {
                name: (float(c["distance"][0]), float(c["spread"][0]))
                for name, c in curves.items()
            }
            for case, curves in found.items()
        },
        "swims": measured_swims(),
        "lift": {name: lifts(name, rod) for name, rod in BARS.items()},
        "reversal": measured_reversals(),
        "stretches": measured_stretches(),
        "ways": ways(),
    }


def predicted(scene_name: str, amplitudes, travels=TRAVELS) -> dict:
    """Return distances by tier, with flat ends and with transients, and their spread by
    the medium, body lengths."""
    law = rod_fit("flank-drag", end_caps="fitted")
    scene = load(scene_name)
    caps = law.caps(RADIUS / SIZE)
    medium = replace(law.medium, covariance=None)
    study = lambda medium, tiers, *effects: SceneTables(
        scene.changed(system=replace(scene.system, medium=medium, effects=effects))
    ).displacements(list(amplitudes), tiers)["net_distance"]
    none = np.zeros(len(amplitudes))
    net = study(law.medium, TIERS, caps)
    curves = {
        tier: {"distance": net.values[k], "spread": net.spread[k]}
        for k, tier in enumerate(TIERS)
    }
    flat = EndCaps(caps.radius, FLAT_ENDS / 2, FLAT_ENDS / 2)
    curves[FLAT] = {
        "distance": study(medium, ("direct",), flat).values[0],
        "spread": none,
    }
    for travel in travels:
        net = study(medium, ("direct",), caps, Transient(travel=travel))
        curves[f"direct, transient {travel:g} BL"] = {
            "distance": net.values[0],
            "spread": none,
        }
    return curves


def over_beds(values: np.ndarray, beds: np.ndarray) -> tuple[float, float]:
    """Return the mean over beds of their means, and its standard error; nan of one
    bed."""
    means = np.array([values[beds == bed].mean() for bed in np.unique(beds)])
    return float(means.mean()), float(means.std(ddof=1) / np.sqrt(len(means))) if len(
        means
    ) > 1 else np.nan


def measured_swims() -> dict[tuple[str, float, float], tuple[float, float]]:
    """Return (distance, error), BL, by scene, amplitude, rad, and frequency, Hz."""
    data = grains.read("swims")
    distance = np.hypot(data["x_BL"], data["y_BL"])
    cases = list(
        zip(*(data[key].tolist() for key in ("scene", "amplitude", "frequency_Hz")))
    )
    mine = {
        case: np.array([other == case for other in cases])
        for case in sorted(set(cases))
    }
    return {
        case: over_beds(distance[rows], data["bed"][rows])
        for case, rows in mine.items()
    }


def lifts(name: str, bar) -> dict:
    """Return lift over drag of a bar in grains and by the nine-term map, as it is and
    without tension, deep down."""
    data = grains.read("lift")
    mine = data["shape"] == name
    value, error = over_beds(data["lift_over_drag"][mine], data["bed"][mine])
    stress = VERTICAL["glass-3mm"].stress
    by_map = {
        t: rod_forces(replace(stress, tension=t), bar.outline(200), 2)["ratio"]
        for t in ("keep", "cut")
    }
    return {"grains": value, "error": error, **by_map}


def reversal_cases(
    depth: float, angle: float, part: str, beds=grains.BEDS, amplitudes=None
) -> list[tuple]:
    """Return (amplitude, travel, drag) of all ways at a depth, m, and an angle,
    degrees; means over beds."""
    data = grains.read("reversals")
    mine = (data["depth_m"] == depth) & (data["angle_deg"] == angle)
    found = []
    for a in np.unique(data["amplitude_m"][mine]) if amplitudes is None else amplitudes:
        rows = [
            mine & (data["amplitude_m"] == a) & (data["bed"] == bed) for bed in beds
        ]
        drag = np.mean([data[f"{part}_N"][r] for r in rows], 0)
        found.append((float(a), data["travel_m"][rows[0]], drag))
    return found


def measured_reversals() -> dict:
    found = {}
    for depth, angle in dict.fromkeys(
        (depth, angle) for _, depth, angle in grains.STROKES
    ):
        for part in ("flank", "ends"):
            fits = np.array(
                [
                    recovery(reversal_cases(depth, angle, part, (bed,)))
                    for bed in grains.BEDS
                ]
            )
            pairs = zip(
                fits.mean(0).tolist(),
                (fits.std(0, ddof=1) / np.sqrt(len(fits))).tolist(),
            )
            found[depth, angle, part] = dict(zip(Recovery._fields, pairs))
    return found


def measured_stretches() -> dict:
    """Return what fits to each bed alone say, drag = late (1 - (1 - share) exp(-travel
    / length)), with the mean of the last 40 % of the stretch as the late drag."""
    from scipy.optimize import curve_fit

    found = {}
    for a, depth, angle in grains.STROKES:
        fits = []
        for bed in grains.BEDS:
            ((_, way, drag),) = reversal_cases(depth, angle, "flank", (bed,), (a,))
            x = (way - 3 * a)[way > 3 * a]
            drag = drag[way > 3 * a]
            share = lambda x, at_once, length: 1 - (1 - at_once) * np.exp(-x / length)
            late = drag[x > 0.6 * 2 * a].mean()
            bounds = [-1, x[1] - x[0]], [1, 4 * a]  # nothing faster than a bin is seen
            (at_once, length), _ = curve_fit(
                share, x, drag / late, (0.2, a / 2), bounds=bounds
            )
            fits.append((at_once, length * np.log((1 - at_once) / 0.05)))
        pairs = np.transpose(
            [np.mean(fits, 0), np.std(fits, 0, ddof=1) / np.sqrt(len(fits))]
        )
        found[a, depth, angle] = {"at_once": tuple(pairs[0]), "travel": tuple(pairs[1])}
    return found


def ways(depth: float = 0.0245, fitted: float = 0.02) -> dict:
    """Return drags after the second reversal, and the law fitted at one amplitude, m,
    alone."""
    found = {}
    for angle in (90.0, 0.0):
        law = recovery(reversal_cases(depth, angle, "flank", amplitudes=(fitted,)))
        for a, travel, drag in reversal_cases(depth, angle, "flank"):
            late = travel > 3 * a
            pair = drag[late] / law.plateau, law.drag(travel, a)[late] / law.plateau
            found[a, angle] = {
                "travel": travel[late] - 3 * a,
                **dict(zip(("grains", "law"), pair)),
            }
    return found


def named_swim(case: tuple[str, float, float]) -> str:
    """Return the name of a swim."""
    scene, amplitude, frequency = case
    gait = {
        grains.CIRCLE: "circle",
        grains.BUTTERFLY: "butterfly",
        grains.WAVE: "seven links",
    }[scene]
    return f"{gait} {amplitude:g} rad" + (
        "" if frequency == 1.0 else f", {frequency:g} Hz"
    )


def by_curves(numbers: dict, case: tuple[str, float, float]) -> dict[str, float]:
    """Return what the curves say of a swim, body lengths; nothing of one that is not
    predicted."""
    scene, amplitude, _ = case
    if scene == grains.CIRCLE:
        at = numbers["amplitude"]
        return {
            name: float(np.interp(amplitude, at, c["distance"]))
            for name, c in numbers["curves"].items()
        }
    return {
        name: x
        for name, (x, _) in numbers["others"].get((scene, amplitude), {}).items()
    }


def table(numbers: dict) -> str:
    """Return the measured displacements beside the curves, lift over drag, and drag
    after reversals."""
    rows = []
    for case, (d, e) in numbers["swims"].items():
        curves = by_curves(numbers, case)
        rows.append(
            (
                named_swim(case),
                f"{d:.3f} +- {e:.3f}",
                *(f"{curves[n]:.3f}" if curves else "" for n in numbers["curves"]),
            )
        )
    lines = style.table(("BL per cycle", "grains", *numbers["curves"]), rows)
    rows = [
        (
            name,
            f"{x['grains']:+.2f} +- {x['error']:.2f}",
            f"{x['keep']:+.2f}",
            f"{x['cut']:+.2f}",
        )
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
    back = style.table(
        ("drag after a reversal", "plateau, N", "at once", "95 % after"), rows
    )
    rows = [
        (
            f"{1e3 * a:g} mm {'across' if angle else 'along'}, {1e3 * depth:.3g} mm deep",
            "{:.2f} +- {:.2f}".format(*x["at_once"]),
            "{:.1f} +- {:.1f} mm".format(*(1e3 * np.array(x["travel"]))),
        )
        for (a, depth, angle), x in sorted(
            numbers["stretches"].items(), key=lambda item: item[0][1:] + item[0][:1]
        )
    ]
    each = style.table(
        ("second reversal", "at once of the late drag", "95 % of it after"), rows
    )
    return f"{lines}\n{lifted}\n{back}\n{each}"


@plots.styled
def draw(numbers: dict):
    fig, axes = plots.figure(9.0, 6.4, 2, 2)
    (left, right), (lift_axes, reversal_axes) = axes
    style.letter_panels(axes)
    draw_circles(left, numbers)
    draw_others(right, numbers)
    draw_lift(lift_axes, numbers["lift"])
    draw_reversals(reversal_axes, numbers["ways"])
    return fig


DOTS = {
    "color": "black",
    "ls": "none",
    "marker": "o",
    "ms": 4,
    "capsize": 2,
    "zorder": 3,
}  # of grains


def looks(curves) -> dict[str, dict]:
    """Return colour, line and marker of every curve, by its name."""
    colours = (style.PINK, style.BLUE, style.VERMILION, "0.5", style.GREEN, style.GREEN)
    lines = ("-", ":", "-", "-", "--", ":")
    markers = "^Dsvx+"
    shape = {"mfc": "white", "ms": 4.5}
    return {
        name: {
            "color": c,
            "ls": ls,
            "marker": m,
            "markevery": (k, len(colours)),
            **shape,
        }
        for k, (name, c, ls, m) in enumerate(zip(curves, colours, lines, markers))
    }


def draw_circles(ax, numbers: dict) -> None:
    """Draw displacements of circles against the amplitude."""
    for name, look in looks(numbers["curves"]).items():
        x = numbers["amplitude"]
        curve = numbers["curves"][name]
        if name == "direct":
            low = curve["distance"] - curve["spread"]
            high = curve["distance"] + curve["spread"]
            ax.fill_between(x, low, high, color=look["color"], alpha=0.2, lw=0)
        ax.plot(x, curve["distance"], **look, label=name)
    for frequency, face in ((1.0, "black"), (0.5, "white")):
        here = {
            a: x
            for (scene, a, f), x in numbers["swims"].items()
            if scene == grains.CIRCLE and f == frequency
        }
        if here:
            d, e = np.transpose(list(here.values()))
            label = "grains" if frequency == 1.0 else f"grains, {frequency:g} Hz"
            ax.errorbar(list(here), d, np.nan_to_num(e), label=label, mfc=face, **DOTS)
    ax.set(
        xlabel="amplitude of the circle (rad)",
        ylabel="distance per cycle (BL)",
        ylim=(0, 0.4),
        xlim=(0.2, 2.15),
    )
    ax.legend(loc="upper left", ncols=2)


def draw_others(ax, numbers: dict) -> None:
    """Draw displacements of other gaits, a row each."""
    for y, (case, curves) in enumerate(numbers["others"].items()):
        for k, (name, look) in enumerate(looks(curves).items()):
            height = y + 0.09 * (k - 2.5)
            ax.plot(curves[name][0], height, **{**look, "ls": "", "markevery": None})
        if swum := numbers["swims"].get((*case, 1.0)):
            ax.errorbar(swum[0], y, xerr=np.nan_to_num(swum[1]), **DOTS)
    names = [named_swim((*case, 1.0)) for case in numbers["others"]]
    ax.set_yticks(range(len(names)), names)
    ax.set(
        xlabel="distance per cycle (BL)",
        ylim=(len(names) - 0.4, -0.6),
        xlim=(0, None),
        title="marks as in (a)",
    )


def draw_lift(ax, lift: dict) -> None:
    """Draw lift over drag by shape."""
    y = np.arange(len(lift))
    for key, marker, label in (
        ("keep", "D", "nine-term map"),
        ("cut", "s", "tension cut"),
    ):
        ax.plot(
            [x[key] for x in lift.values()],
            y,
            marker,
            mfc="white",
            color=style.BLUE,
            label=label,
        )
    errors = np.nan_to_num([x["error"] for x in lift.values()])
    ax.errorbar(
        [x["grains"] for x in lift.values()], y, xerr=errors, label="grains", **DOTS
    )
    ax.axvline(0.0, **style.GUIDE)
    ax.set_yticks(y, list(lift))
    ax.set(xlabel="lift over drag", ylim=(len(lift) - 0.5, -1.2))
    ax.legend(loc="upper right", ncols=1)


def draw_reversals(ax, ways: dict) -> None:
    """Draw drags against the travel since a reversal, in grains and by the law."""
    for (a, angle), way in ways.items():
        if angle or a == 0.02:
            colour = style.SEQUENCE[(0.01, 0.02, 0.04).index(a)] if angle else "0.5"
            x = 1e3 * way["travel"]
            label = f"{1e3 * a:g} mm {'across' if angle else 'along'}"
            ax.plot(x, way["grains"], ".", ms=3, color=colour)
            ax.plot(x, way["law"], color=colour, label=label)
    ax.set(
        xlabel="travel since the reversal (mm)",
        ylabel="drag over that after a long way",
        xlim=(0, 80),
    )
    ax.set(ylim=(0, 1.3))
    ax.legend(loc="lower right")


if __name__ == "__main__":
    main("grains", compute, draw, table)
