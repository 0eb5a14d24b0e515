"""Plates and bars in beds of grains: stress on leading faces by tilt, and the tilts at
which the map for plates pulls.

Resistive force theory assumes that the stress on a part of a bar equals the stress on a
plate of the same tilt at the same depth (Fig. 8(a)), and the map for plates pulls on
faces that look up by more than 53 degrees. The beds are those of `figures.grains.beds`.
Bars and plates are towed level at 0.1 m/s, 16 mm deep. Stress is divided by the depth
of each part, with the signs of `figures.paper.fig08a_rods`. Errors are standard errors
over three beds (two for the shell).

Left and middle: normal and tangential stress on the rows of spheres of a round bar, and
on the middle of the leading face of plates, without half a grain at the edges; open: on
whole plates, with edges and rear faces. The map has the zeta that fits the middle of
the plates best where it pushes, and is dashed where it pulls. Right: lift over drag on
the leading curved faces of three bars, of plates summed over these faces, by the map
over them, and on whole bars; and on a thin half shell whose hollow leads.

The data are in `figures/grains/campaigns`; each file names the command that computed
it.
"""

from __future__ import annotations

import itertools

import numpy as np

from figures import main, style
from figures.grains.beds import bed_mean, mean_and_error
from figures.grains.campaigns import grains
from figures.paper.fig08a_rods import face_stress
from geomech import plots
from rft.terradynamics.plates import Polygon, StressMap, loads

RULES = {"keep": "map", "cut": "tension cut"}  # of the map where it pulls
BETA = np.radians(np.arange(181.0))
COMPONENTS = ("normal", "tangent")
PARTS = ("face", "rear", "whole")  # of a plate
MEASURED = {"whole": "whole bar", "faces": "curved face", "plates": "plates over it"}
ARC_CENTRES = {  # m, over the axis
    "round": 0.0,
    "half round": -grains.BAR / 2,
    "half round, flat up": grains.BAR / 2,
}
ARC_RADIUS = grains.BAR - grains.GRAIN  # m, of the outer spheres' centres
UNKNOWN = (np.nan, np.nan)
DOTS = {"ls": "none", "ms": 4, "capsize": 2}


def compute() -> dict:
    """Return measured stresses, and lift over drag.

    "plates": by height, m, {"beta": (P,), rad, and by part, "face", "rear" and "whole",
    by component, "normal" and "tangent": (P, beds), N/cm^3}. "bar": {"beta": (R,),
    "normal", "tangent": (R, beds)} of the leading rows of the round bar. "maps": by
    rule {"zeta", "normal", "tangent": at `BETA`, N/cm^3, "misfit": rms difference from
    the net stress on plates and from the bar, each over its rms}. "bars": by name
    {"faces", "whole", "plates": (mean, error), "keep", "cut"}, lift over drag.
    """
    plates = {height: measured_plates(height, len(b)) for height, b in grains.PLATES}
    main_plates = plates[grains.PLATES[0][0]]
    faces = {name: leading_rows(name) for name in grains.BARS}
    maps = fitted_maps(main_plates, faces["round"])
    bars = {name: bar_lifts(name, faces[name], main_plates, maps) for name in faces}
    bars[grains.SHELL] = shell_lifts()
    return {"plates": plates, "bar": faces["round"], "maps": maps, "bars": bars}


# Measurements


def measured_plates(height: float, tilts: int) -> dict:
    """Return tilts, rad, and stress over depth, N/cm^3, on plates of a height, m."""
    data = grains.read("plates")
    rows = data["height_m"] == height

    def column(name: str) -> np.ndarray:
        return data[name][rows].reshape(tilts, -1)

    plates: dict = {"beta": np.radians(column("beta_deg")[:, 0])}
    for part in PARTS:
        plates[part] = {c: column(f"{part}_{c}_N/cm3") for c in COMPONENTS}
    return plates


def leading_rows(name: str) -> dict:
    """Return the rows of spheres on the curved leading face of a bar, without corners
    and flat sides.

    {"beta", "weight": (R,), tilt, rad, and depth times area, m^3, "drag", "lift": (R,
    beds), N, "normal", "tangent": (R, beds), stress over depth, N/cm^3}. Half of a row
    that slides along itself leads, and it counts half.
    """
    data = grains.read("faces")
    rows = data["shape"] == name
    beds = len(np.unique(data["bed"][rows]))

    def column(key: str) -> np.ndarray:
        return data[key][rows].reshape(beds, -1).T

    y = column("y_m")[:, 0]
    z = column("z_m")[:, 0] - ARC_CENTRES[name]
    leads = (y > -1e-6) & np.isclose(np.hypot(y, z), ARC_RADIUS, rtol=1e-3)
    if name != "round":
        is_corner = np.isclose(np.abs(z), grains.GRAIN, rtol=1e-3)
        leads &= ~is_corner
    beta = np.arctan2(np.maximum(y, 0.0), -z)
    order = np.flatnonzero(leads)[np.argsort(beta[leads])]
    beta = beta[order]
    fraction = np.where(y[order] < 1e-6, 0.5, 1.0)
    drag = fraction[:, None] * column("drag_N")[order]
    lift = fraction[:, None] * column("lift_N")[order]

    area = fraction * grains.BAR * np.diff(beta).mean() * grains.TROUGH.length
    depth = grains.BAR_DEPTH - ARC_CENTRES[name] + grains.BAR * np.cos(beta)
    weight = area * depth
    sin = np.sin(beta)[:, None]
    cos = np.cos(beta)[:, None]
    per_weight = 1e-6 / weight[:, None]
    return {
        "beta": beta,
        "weight": weight,
        "drag": drag,
        "lift": lift,
        "normal": (drag * sin + lift * cos) * per_weight,
        "tangent": (lift * sin - drag * cos) * per_weight,
    }


# The map


def fitted_maps(plates: dict, bar: dict) -> dict:
    """Return the map by rule, with the zeta that fits the net stress on plates best
    where it pushes, and its misfits."""
    net = [plates["face"][c] + plates["rear"][c] for c in COMPONENTS]
    on_plates = np.concatenate([x.mean(1) for x in net])
    on_bar = np.concatenate([bar[c].mean(1) for c in COMPONENTS])
    unit = {}
    for rule in RULES:
        unit[rule] = dict(zip(COMPONENTS, face_stress(StressMap(tension=rule), BETA)))
    x = map_stress(unit["cut"], plates["beta"])
    zeta = float(x @ on_plates / (x @ x))
    maps = {}
    for rule in RULES:
        scaled = {c: zeta * unit[rule][c] for c in COMPONENTS}
        misfits = (
            relative_rms(on_plates, map_stress(scaled, plates["beta"])),
            relative_rms(on_bar, map_stress(scaled, bar["beta"])),
        )
        maps[rule] = {"zeta": zeta, **scaled, "misfit": misfits}
    return maps


def map_stress(stress: dict, beta: np.ndarray) -> np.ndarray:
    """Return normal and tangential stress of a map at tilts (B,), one after the
    other."""
    return np.concatenate([np.interp(beta, BETA, stress[c]) for c in COMPONENTS])


def relative_rms(values: np.ndarray, by_map: np.ndarray) -> float:
    """Return the rms difference of values from those by a map, over their rms."""
    return float(np.sqrt(np.sum((values - by_map) ** 2) / np.sum(values**2)))


# Lift over drag


def lift_over_drag(rows: dict, beta, normal, tangent) -> float:
    """Return lift over drag by stress over depth (B,) at tilts beta, on rows of a
    bar."""
    sin = np.sin(rows["beta"])
    cos = np.cos(rows["beta"])
    sigma = rows["weight"] * np.interp(rows["beta"], beta, normal)
    tau = rows["weight"] * np.interp(rows["beta"], beta, tangent)
    return float((sigma * cos + tau * sin).sum() / (sigma * sin - tau * cos).sum())


def bar_lifts(name: str, rows: dict, plates: dict, maps: dict) -> dict:
    """Return lift over drag of a bar's leading curved face, of the whole bar, of plates
    and by the map."""
    data = grains.read("lift")
    is_bar = data["shape"] == name
    beds = data["bed"][is_bar]
    face = plates["face"]
    plate_lifts = [
        lift_over_drag(rows, plates["beta"], normal, tangent)
        for normal, tangent in zip(face["normal"].T, face["tangent"].T)
    ]
    lifts = {
        "faces": bed_mean(rows["lift"].sum(0) / rows["drag"].sum(0), beds),
        "whole": bed_mean(data["lift_over_drag"][is_bar], beds),
        "plates": bed_mean(np.array(plate_lifts), beds),
    }
    for rule, stress in maps.items():
        lifts[rule] = lift_over_drag(rows, BETA, stress["normal"], stress["tangent"])
    return lifts


def shell_lifts() -> dict:
    """Return lift over drag of half a round tube whose hollow leads, in grains and by
    the map, which sums over both sides."""
    data = grains.read("faces")
    is_shell = data["shape"] == grains.SHELL
    beds = np.unique(data["bed"][is_shell])
    drag = data["drag_N"][is_shell].reshape(len(beds), -1).sum(1)
    lift = data["lift_N"][is_shell].reshape(len(beds), -1).sum(1)
    phi = np.linspace(-np.pi / 2, np.pi / 2, 201)
    arc = zip(-ARC_RADIUS * np.cos(phi), ARC_RADIUS * np.sin(phi))
    sheet = Polygon(tuple(arc), grains.TROUGH.length, closed=False).outline(400)
    pose = [0, -grains.BAR_DEPTH, 0]
    velocity = [grains.SPEED, 0, 0]
    lifts = {
        "whole": bed_mean(lift / drag, beds),
        "faces": UNKNOWN,
        "plates": UNKNOWN,
    }
    for rule in RULES:
        force = loads(StressMap(tension=rule), sheet, pose, velocity).force
        lifts[rule] = float(-force[1] / force[0])
    return lifts


# Tables


def table(numbers: dict) -> str:
    """Return stress on plates of two heights, lift over drag of bars, and the maps'
    misfits."""
    columns = list(itertools.product(PARTS, COMPONENTS))
    rows = []
    for height, plates in numbers["plates"].items():
        for k, beta in enumerate(np.degrees(plates["beta"])):
            cells = [f"{1e3 * height:.0f} mm at {beta:.0f}"]
            for part, c in columns:
                mean, error = mean_and_error(1e3 * plates[part][c][k])
                cells.append(f"{mean:+.1f} +- {error:.1f}")
            rows.append(cells)
    heads = [f"{part}, {c}" for part, c in columns]
    stress = style.table(("stress / depth (kN/m3)", *heads), rows)

    rows = []
    for name, lifts in numbers["bars"].items():
        cells = [with_error(*lifts[key]) for key in MEASURED]
        cells += [f"{lifts[rule]:+.2f}" for rule in RULES]
        rows.append([name, *cells])
    heads = ["lift over drag", *MEASURED.values(), *RULES.values()]
    bars = style.table(heads, rows)

    rows = []
    for rule, stress_map in numbers["maps"].items():
        misfits = [f"{100 * misfit:.0f} %" for misfit in stress_map["misfit"]]
        rows.append([rule, f"{stress_map['zeta']:.4f}", *misfits])
    maps = style.table(("tension", "zeta", "off plates", "off the bar"), rows)
    return f"{stress}\n{bars}\n{maps}"


def with_error(mean: float, error: float) -> str:
    """Return a mean with its error, "-" where there is none."""
    if np.isnan(mean):
        return "-"
    return f"{mean:+.2f} +- {error:.2f}"


# The picture


@plots.styled
def draw(numbers: dict):
    """Draw both components of stress and lift over drag."""
    fig, axes = plots.figure(9.6, 3.1, 3)
    left, middle, right = axes[0]
    draw_stress(left, numbers, "normal", "normal")
    draw_stress(middle, numbers, "tangent", "tangential")
    left.legend(loc="lower left")
    draw_lifts(right, numbers["bars"])
    style.letter_panels(axes)
    return fig


def draw_stress(ax, numbers: dict, component: str, name: str) -> None:
    """Draw a component of stress over depth against tilt."""
    for rule, dashes in (("keep", "--"), ("cut", "-")):
        stress = 1e3 * numbers["maps"][rule][component]
        look = {"color": style.BLUE, "label": RULES[rule]}
        ax.plot(np.degrees(BETA), stress, dashes, **look)
    x = np.degrees(numbers["bar"]["beta"])
    y, error = mean_and_error(1e3 * numbers["bar"][component])
    ax.fill_between(x, y - error, y + error, color="0.75", lw=0)
    ax.plot(x, y, color="0.3", label="round bar")
    colours = (style.VERMILION, style.PINK)
    for (height, plates), colour in zip(numbers["plates"].items(), colours):
        x = np.degrees(plates["beta"])
        size = f"{1e3 * height:.0f} mm"
        look = {"marker": "o", "color": colour, **DOTS}
        y, error = mean_and_error(1e3 * plates["face"][component])
        ax.errorbar(x, y, error, label=f"plates of {size}", **look)
        y, error = mean_and_error(1e3 * plates["whole"][component])
        ax.errorbar(x, y, error, mfc="white", label=f"{size}, with edges", **look)
    style.draw_zero_line(ax)
    ax.set(xlabel="tilt of the face (degrees)", xlim=(0, 180))
    ticks = ["0\nunderside", 45, "90\nfront", 135, "180\ntop"]
    ax.set_xticks(range(0, 181, 45), ticks)
    ax.set(ylabel=f"{name} stress / depth (kN/m$^3$)")


def draw_lifts(ax, bars: dict) -> None:
    """Draw lift over drag, a row for each bar."""
    y = np.arange(len(bars))
    looks = (
        ("faces", "o", "0.3"),
        ("plates", "o", style.VERMILION),
        ("whole", "s", "0.6"),
    )
    for k, (key, marker, colour) in enumerate(looks):
        x, error = np.array([lifts[key] for lifts in bars.values()]).T
        dots = {"marker": marker, "color": colour, "label": MEASURED[key], **DOTS}
        ax.errorbar(x, y + 0.15 * (k - 1), xerr=error, **dots)
    for rule, marker in (("keep", "D"), ("cut", "^")):
        x = [lifts[rule] for lifts in bars.values()]
        look = {"mfc": "white", "color": style.BLUE, "label": RULES[rule]}
        ax.plot(x, y, marker, **look)
    ax.axvline(0.0, **style.GUIDE)
    ax.set_yticks(y, [name.replace(", ", ",\n") for name in bars])
    ax.set(xlabel="lift over drag", ylim=(len(y) - 0.5, -1.6), xlim=(-1.2, 1.8))
    ax.legend(loc="upper left", ncols=2, columnspacing=0.5)


if __name__ == "__main__":
    main("grain_plates", compute, draw, table)
