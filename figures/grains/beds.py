"""Resistive force theory against beds of grains: swimmers, lift on bars, and drag after
a reversal.

The grains are spheres of 6 mm with friction 0.3 and 1 MPa, in beds that differ by their
seeds. Error bars are standard errors over beds.

(a) Displacement of three links, 162 x 12 mm at a depth of 25 mm, on circles, next to
the tiers with the law of the flank and the ends, both measured in the same grains
(band: one standard deviation of the law of the flank): with ends whose axial force
falls with the angle as on rods, with flat ends, and with a transient over two travels.
(b) The same for the butterfly and for a wave on seven links. (c) Lift over drag on bars
without ends, next to the nine-term map, as it is and without tension. (d) Drag on the
flank of a rod after its second reversal, over the drag after a long travel, in grains
(dots) and by the law of the effect `transient` (lines). The law is fitted at 20 mm
alone; 10 and 40 mm are predicted.

The size, depth and friction of the robot of Fig. 11(e) are not in the text of the
paper, so this figure does not reproduce it. The data are in `figures/grains/campaigns`;
each file names the command that computed it.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from figures import main, style
from figures.grains.campaigns import grains
from figures.paper.fig08a_rods import TENSIONS, rod_forces
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
TIERS = ("area", "harmonic", "direct")
# Travels of the transient, body lengths: as the flank's drag recovers in these swims,
# and as on a rod that moves back and forth.
TRAVELS = (0.05, 0.21)
OTHERS = (
    (grains.BUTTERFLY, 1.0),
    (grains.WAVE, 0.5),
    (grains.WAVE, 0.87),
    (grains.WAVE, 1.2),
)
GAIT_NAMES = {
    grains.CIRCLE: "circle",
    grains.BUTTERFLY: "butterfly",
    grains.WAVE: "seven links",
}
FLAT = "direct, flat ends"
FLAT_ENDS = 1.71  # e of both ends, fitted to the same rods
BARS = {  # by their names in the data
    "round": RoundRod(grains.BAR, 0.1),
    "half round": HalfCylinder(grains.BAR, 0.1, "down"),
    "half round, flat up": HalfCylinder(grains.BAR, 0.1, "up"),
}
# m: depth of the strokes that are drawn, and the amplitude to which their law is fitted
STROKE_DEPTH = 0.0245
FITTED_AMPLITUDE = 0.02


def compute(amplitudes=AMPLITUDES, others=OTHERS, travels=TRAVELS) -> dict:
    """Return predicted and measured numbers.

    "amplitude": (A,), rad. "curves": by name {"distance", "spread": (A,), BL} of
    circles, spread only of the law. "others": by scene and amplitude, by name distances
    and spread (float, float). "swims": by scene, amplitude, rad, and frequency, Hz,
    (distance, error), BL. "lift": by shape {"grains", "error", "keep", "cut"}, lift
    over drag. "reversal": by (depth, m, angle from the axis, degrees) and "flank" or
    "ends" {"plateau", "at_once", "travel", "start", "rms": (mean, error)} of
    `rft.grains.reversal.Recovery`, by all amplitudes together. "last_strokes": by
    (amplitude, m, depth, m, angle) (mean, error) of the share of the flank's late drag
    that is there at once after the second reversal, and of the travel, m, to 95 % of
    it. "after_reversal": by (amplitude, m, angle) {"travel" since the second reversal,
    m, "grains", "law"}, shares of the plateau, at STROKE_DEPTH."""
    predictions: dict = {}
    for scene, amplitude in others:
        curves = predicted_curves(scene, [amplitude], travels)
        predictions[scene, amplitude] = {}
        for name, curve in curves.items():
            pair = (float(curve["distance"][0]), float(curve["spread"][0]))
            predictions[scene, amplitude][name] = pair
    return {
        "amplitude": np.asarray(amplitudes),
        "curves": predicted_curves(grains.CIRCLE, amplitudes, travels),
        "others": predictions,
        "swims": measured_swims(),
        "lift": {name: bar_lift(name, bar) for name, bar in BARS.items()},
        "reversal": measured_reversals(),
        "last_strokes": measured_last_strokes(),
        "after_reversal": drag_after_reversal(),
    }


# Swims


def predicted_curves(scene_name: str, amplitudes, travels=TRAVELS) -> dict:
    """Return {"distance", "spread": (A,)} by tier, with flat ends and with transients,
    body lengths. The spread is that by the law of the medium; 0 for all but tiers."""
    law = rod_fit("flank-drag", end_caps="fitted")
    scene = load(scene_name)
    caps = law.caps(RADIUS / SIZE)

    def net_distance(medium, tiers, effects):
        system = replace(scene.system, medium=medium, effects=effects)
        tables = SceneTables(scene.changed(system=system))
        return tables.displacements(list(amplitudes), tiers)["net_distance"]

    curves = {}
    net = net_distance(law.medium, TIERS, (caps,))
    for tier, distance, spread in zip(TIERS, net.values, net.spread):
        curves[tier] = {"distance": distance, "spread": spread}

    flat_caps = EndCaps(caps.radius, FLAT_ENDS / 2, FLAT_ENDS / 2)
    effects: dict = {FLAT: (flat_caps,)}
    for travel in travels:
        name = f"direct, transient {travel:g} BL"
        effects[name] = (caps, Transient(travel=travel))
    medium = replace(law.medium, covariance=None)
    for name, of_curve in effects.items():
        net = net_distance(medium, ("direct",), of_curve)
        no_spread = np.zeros(len(amplitudes))
        curves[name] = {"distance": net.values[0], "spread": no_spread}
    return curves


def measured_swims() -> dict[tuple[str, float, float], tuple[float, float]]:
    """Return (distance, error), BL, by scene, amplitude, rad, and frequency, Hz."""
    data = grains.read("swims")
    distance = np.hypot(data["x_BL"], data["y_BL"])
    columns = (data["scene"], data["amplitude"], data["frequency_Hz"])
    cases = list(zip(*(column.tolist() for column in columns)))
    swims = {}
    for case in sorted(set(cases)):
        rows = np.array([other == case for other in cases])
        swims[case] = bed_mean(distance[rows], data["bed"][rows])
    return swims


def bed_mean(values: np.ndarray, beds: np.ndarray) -> tuple[float, float]:
    """Return the mean over beds of each bed's mean of values (N,) in beds (N,), and its
    standard error; the error is nan for one bed."""
    means = np.array([values[beds == bed].mean() for bed in np.unique(beds)])
    if len(means) == 1:
        return float(means.mean()), np.nan
    mean, error = mean_and_error(means)
    return float(mean), float(error)


def mean_and_error(values: np.ndarray) -> tuple:
    """Return the mean over beds of values (..., beds), and its standard error."""
    return values.mean(-1), values.std(-1, ddof=1) / np.sqrt(values.shape[-1])


# Lift


def bar_lift(name: str, bar) -> dict:
    """Return lift over drag of a bar in grains and by the nine-term map, as it is and
    without tension, deep down."""
    data = grains.read("lift")
    rows = data["shape"] == name
    mean, error = bed_mean(data["lift_over_drag"][rows], data["bed"][rows])
    lift = {"grains": mean, "error": error}
    for tension in TENSIONS:
        stress = replace(VERTICAL["glass-3mm"].stress, tension=tension)
        lift[tension] = rod_forces(stress, bar.outline(200), 2)["ratio"]
    return lift


# Reversals


def stroke_drags(
    depth: float, angle: float, part: str, beds=grains.BEDS, amplitudes=None
) -> list[tuple]:
    """Return (amplitude, travel (N,), drag (N,)) of strokes at a depth, m, and an
    angle, degrees, of "flank" or "ends"; means over beds, m and N.

    amplitudes: all by default."""
    data = grains.read("reversals")
    is_case = (data["depth_m"] == depth) & (data["angle_deg"] == angle)
    if amplitudes is None:
        amplitudes = np.unique(data["amplitude_m"][is_case])
    strokes = []
    for amplitude in amplitudes:
        is_stroke = is_case & (data["amplitude_m"] == amplitude)
        rows = [is_stroke & (data["bed"] == bed) for bed in beds]
        drag = np.mean([data[f"{part}_N"][row] for row in rows], 0)
        strokes.append((float(amplitude), data["travel_m"][rows[0]], drag))
    return strokes


def measured_reversals() -> dict:
    """Return the mean and error over beds of the fields of `Recovery`, by depth, m,
    angle, degrees, and part."""
    cases = dict.fromkeys((depth, angle) for _, depth, angle in grains.STROKES)
    reversals = {}
    for depth, angle in cases:
        for part in ("flank", "ends"):
            fits = []
            for bed in grains.BEDS:
                fits.append(recovery(stroke_drags(depth, angle, part, (bed,))))
            mean, error = mean_and_error(np.transpose(fits))
            pairs = zip(mean.tolist(), error.tolist())
            reversals[depth, angle, part] = dict(zip(Recovery._fields, pairs))
    return reversals


def recovered_share(travel, at_once, length):
    """Return drag over late drag after a travel since a reversal."""
    return 1 - (1 - at_once) * np.exp(-travel / length)


def measured_last_strokes() -> dict:
    """Return fits of `recovered_share` to the flank's drag after the second reversal,
    for each amplitude alone, as (mean, error) over beds.

    "at_once": the share; "travel": to 95 % of the late drag, m. The late drag is the
    mean over the last 40 % of the stroke."""
    last_strokes = {}
    for amplitude, depth, angle in grains.STROKES:
        fits = []
        for bed in grains.BEDS:
            (stroke,) = stroke_drags(depth, angle, "flank", (bed,), (amplitude,))
            fits.append(fit_last_stroke(*stroke))
        mean, error = mean_and_error(np.transpose(fits))
        at_once, travel = zip(mean, error)
        last_strokes[amplitude, depth, angle] = {"at_once": at_once, "travel": travel}
    return last_strokes


def fit_last_stroke(
    amplitude: float, travel: np.ndarray, drag: np.ndarray
) -> tuple[float, float]:
    """Return the share that is there at once after the second reversal and the travel
    to 95 % of the late drag, m, of drags (N,) at travels (N,) since the start, m."""
    from scipy.optimize import curve_fit

    # A rod reverses after one amplitude, and again after three.
    is_last = travel > 3 * amplitude
    x = travel[is_last] - 3 * amplitude
    drag = drag[is_last]
    late_drag = drag[x > 0.6 * 2 * amplitude].mean()
    # No recovery within less than a bin shows in the data.
    bounds = ([-1, x[1] - x[0]], [1, 4 * amplitude])
    start = (0.2, amplitude / 2)
    fit, _ = curve_fit(recovered_share, x, drag / late_drag, start, bounds=bounds)
    at_once, length = fit
    return at_once, length * np.log((1 - at_once) / 0.05)


def drag_after_reversal() -> dict:
    """Return drags after the second reversal over the plateau, by amplitude, m, and
    angle, degrees, in grains and by the law fitted at FITTED_AMPLITUDE alone."""
    drags = {}
    for angle in (90.0, 0.0):
        fitted = stroke_drags(
            STROKE_DEPTH, angle, "flank", amplitudes=(FITTED_AMPLITUDE,)
        )
        law = recovery(fitted)
        for amplitude, travel, drag in stroke_drags(STROKE_DEPTH, angle, "flank"):
            is_last = travel > 3 * amplitude
            by_law = law.drag(travel, amplitude)
            drags[amplitude, angle] = {
                "travel": travel[is_last] - 3 * amplitude,
                "grains": drag[is_last] / law.plateau,
                "law": by_law[is_last] / law.plateau,
            }
    return drags


# Tables


def table(numbers: dict) -> str:
    """Return the measured displacements next to the curves, lift over drag, and drag
    after reversals."""
    tables = (
        swim_table(numbers),
        lift_table(numbers["lift"]),
        reversal_table(numbers["reversal"]),
        last_stroke_table(numbers["last_strokes"]),
    )
    return "\n".join(tables)


def swim_table(numbers: dict) -> str:
    """Return displacements in grains and by the curves, body lengths per cycle."""
    rows = []
    for case, (distance, error) in numbers["swims"].items():
        row = [swim_name(case), with_error(distance, error, 3)]
        predicted = curve_distances(numbers, case)
        for name in numbers["curves"]:
            cell = ""
            if predicted:
                cell = f"{predicted[name]:.3f}"
            row.append(cell)
        rows.append(row)
    return style.table(("BL per cycle", "grains", *numbers["curves"]), rows)


def swim_name(case: tuple[str, float, float]) -> str:
    """Return the name of a swim by scene, amplitude and frequency."""
    scene, amplitude, frequency = case
    name = f"{GAIT_NAMES[scene]} {amplitude:g} rad"
    if frequency != 1.0:
        name += f", {frequency:g} Hz"
    return name


def curve_distances(numbers: dict, case: tuple[str, float, float]) -> dict[str, float]:
    """Return the predicted distances of a swim by curve, body lengths; an empty
    dictionary if it is not predicted."""
    scene, amplitude, _ = case
    distances = {}
    if scene == grains.CIRCLE:
        for name, curve in numbers["curves"].items():
            distance = np.interp(amplitude, numbers["amplitude"], curve["distance"])
            distances[name] = float(distance)
    elif (scene, amplitude) in numbers["others"]:
        for name, (distance, _) in numbers["others"][scene, amplitude].items():
            distances[name] = distance
    return distances


def lift_table(lift: dict) -> str:
    """Return lift over drag by shape."""
    rows = []
    for name, ratios in lift.items():
        measured = f"{ratios['grains']:+.2f} +- {ratios['error']:.2f}"
        by_map = [f"{ratios[tension]:+.2f}" for tension in TENSIONS]
        rows.append((name, measured, *by_map))
    return style.table(("lift over drag", "grains", "map", "tension cut"), rows)


def reversal_table(reversal: dict) -> str:
    """Return plateau, share at once and travel by depth, direction and part."""
    rows = []
    for (depth, angle, part), fit in reversal.items():
        row = (
            f"{part} {direction_name(angle)}, {1e3 * depth:.3g} mm deep",
            with_error(*fit["plateau"], 2),
            with_error(*fit["at_once"], 2),
            with_error(*in_millimetres(fit["travel"]), 0) + " mm",
        )
        rows.append(row)
    heads = ("drag after a reversal", "plateau, N", "at once", "95 % after")
    return style.table(heads, rows)


def last_stroke_table(last_strokes: dict) -> str:
    """Return share at once and travel after the second reversal, by depth, direction
    and amplitude."""

    def order(case):
        amplitude, depth, angle = case
        return depth, angle, amplitude

    rows = []
    for case in sorted(last_strokes, key=order):
        amplitude, depth, angle = case
        size = f"{1e3 * amplitude:g} mm {direction_name(angle)}"
        fit = last_strokes[case]
        row = (
            f"{size}, {1e3 * depth:.3g} mm deep",
            with_error(*fit["at_once"], 2),
            with_error(*in_millimetres(fit["travel"]), 1) + " mm",
        )
        rows.append(row)
    heads = ("second reversal", "at once of the late drag", "95 % of it after")
    return style.table(heads, rows)


def direction_name(angle: float) -> str:
    """Return the direction of motion at an angle from the axis of a rod."""
    return "across" if angle else "along"


def in_millimetres(lengths) -> np.ndarray:
    """Return lengths, m, in mm."""
    return 1e3 * np.array(lengths)


def with_error(mean: float, error: float, digits: int) -> str:
    """Return a mean and its error with as many decimal digits."""
    return f"{mean:.{digits}f} +- {error:.{digits}f}"


# The picture

MEASURED_DOTS = {
    "color": "black",
    "ls": "none",
    "marker": "o",
    "ms": 4,
    "capsize": 2,
    "zorder": 3,
}
CURVE_LOOKS = (  # colour, line and marker of the curves, in their order
    (style.PINK, "-", "^"),
    (style.BLUE, ":", "D"),
    (style.VERMILION, "-", "s"),
    ("0.5", "-", "v"),
    (style.GREEN, "--", "x"),
    (style.GREEN, ":", "+"),
)
ACROSS_COLOURS = {0.01: style.BLACK, 0.02: style.BLUE, 0.04: style.GREEN}


@plots.styled
def draw(numbers: dict):
    """Draw circles, other gaits, lift, and drag after a reversal."""
    fig, axes = plots.figure(9.0, 6.4, 2, 2)
    style.letter_panels(axes)
    draw_circles(axes[0, 0], numbers)
    draw_others(axes[0, 1], numbers)
    draw_lift(axes[1, 0], numbers["lift"])
    draw_reversals(axes[1, 1], numbers["after_reversal"])
    return fig


def curve_looks(curves) -> dict[str, dict]:
    """Return colour, line and marker of every curve, by its name."""
    looks = {}
    for k, (name, (colour, line, marker)) in enumerate(zip(curves, CURVE_LOOKS)):
        looks[name] = {
            "color": colour,
            "ls": line,
            "marker": marker,
            "markevery": (k, len(CURVE_LOOKS)),
            "mfc": "white",
            "ms": 4.5,
        }
    return looks


def draw_circles(ax, numbers: dict) -> None:
    """Draw displacements of circles against the amplitude."""
    amplitude = numbers["amplitude"]
    for name, look in curve_looks(numbers["curves"]).items():
        curve = numbers["curves"][name]
        if name == "direct":
            low = curve["distance"] - curve["spread"]
            high = curve["distance"] + curve["spread"]
            ax.fill_between(amplitude, low, high, color=look["color"], alpha=0.2, lw=0)
        ax.plot(amplitude, curve["distance"], **look, label=name)
    draw_measured_circles(ax, numbers["swims"], 1.0, mfc="black", label="grains")
    draw_measured_circles(
        ax, numbers["swims"], 0.5, mfc="white", label="grains, 0.5 Hz"
    )
    ax.set(xlabel="amplitude of the circle (rad)", ylabel="distance per cycle (BL)")
    ax.set(xlim=(0.2, 2.15), ylim=(0, 0.4))
    ax.legend(loc="upper left", ncols=2)


def draw_measured_circles(ax, swims: dict, frequency: float, **look) -> None:
    """Draw the displacements of circles in grains at a frequency, Hz."""
    circles = {}
    for (scene, amplitude, swim_frequency), pair in swims.items():
        if scene == grains.CIRCLE and swim_frequency == frequency:
            circles[amplitude] = pair
    if circles:
        distance, error = np.transpose(list(circles.values()))
        look = {**look, **MEASURED_DOTS}
        ax.errorbar(list(circles), distance, np.nan_to_num(error), **look)


def draw_others(ax, numbers: dict) -> None:
    """Draw displacements of other gaits, a row each."""
    names = []
    for y, (case, curves) in enumerate(numbers["others"].items()):
        for k, (name, look) in enumerate(curve_looks(curves).items()):
            mark = {**look, "ls": "", "markevery": None}
            ax.plot(curves[name][0], y + 0.09 * (k - 2.5), **mark)
        swim = (*case, 1.0)
        names.append(swim_name(swim))
        if swim in numbers["swims"]:
            distance, error = numbers["swims"][swim]
            ax.errorbar(distance, y, xerr=np.nan_to_num(error), **MEASURED_DOTS)
    ax.set_yticks(range(len(names)), names)
    ax.set(xlabel="distance per cycle (BL)", title="marks as in (a)")
    ax.set(xlim=(0, None), ylim=(len(names) - 0.4, -0.6))


def draw_lift(ax, lift: dict) -> None:
    """Draw lift over drag by shape."""
    y = np.arange(len(lift))
    look = {"mfc": "white", "color": style.BLUE}

    def column(key: str) -> list:
        return [ratios[key] for ratios in lift.values()]

    ax.plot(column("keep"), y, "D", label="nine-term map", **look)
    ax.plot(column("cut"), y, "s", label="tension cut", **look)
    errors = np.nan_to_num(column("error"))
    ax.errorbar(column("grains"), y, xerr=errors, label="grains", **MEASURED_DOTS)
    ax.axvline(0.0, **style.GUIDE)
    ax.set_yticks(y, list(lift))
    ax.set(xlabel="lift over drag", ylim=(len(lift) - 0.5, -1.2))
    ax.legend(loc="upper right", ncols=1)


def draw_reversals(ax, after_reversal: dict) -> None:
    """Draw drags against the travel since a reversal, in grains and by the law: across
    for all amplitudes, along for the fitted one."""
    for (amplitude, angle), stroke in after_reversal.items():
        if angle:
            colour = ACROSS_COLOURS[amplitude]
        elif amplitude == FITTED_AMPLITUDE:
            colour = "0.5"
        else:
            continue
        travel = 1e3 * stroke["travel"]
        label = f"{1e3 * amplitude:g} mm {direction_name(angle)}"
        ax.plot(travel, stroke["grains"], ".", ms=3, color=colour)
        ax.plot(travel, stroke["law"], color=colour, label=label)
    ax.set(
        xlabel="travel since the reversal (mm)",
        ylabel="drag over that after a long way",
        xlim=(0, 80),
        ylim=(0, 1.3),
    )
    ax.legend(loc="lower right")


if __name__ == "__main__":
    main("grains", compute, draw, table)
