"""Plates and bars in beds of grains: stress by tilt on the leading faces of both, and where the map of plates pulls.

Resistive force theory takes the stress on a part of a bar for that on a plate of the same tilt at the same depth (Fig. 8(a)),
and the map of plates pulls on faces that look up by more than 53 degrees. The beds are those of `figures.grains`; bars and
plates are towed level at 0.1 m/s, 16 mm deep. Stress is over the depth of each part, signs are as in `figures.fig08a_rods`;
errors are standard errors over three beds (two of the shell).

Left and middle: normal and tangential stress on the rows of spheres of a round bar, and in the middle of the leading face of
plates, half a grain off their edges; open: on all of the plates, with edges and rear faces. The map has the zeta that fits
the middle of the plates best where it pushes, and is dashed where it pulls. Right: lift over drag on the leading curved faces
of three bars, of plates that are summed over them, by the map over them, and of the bars with all that they bear; and of a
thin half shell whose hollow leads.

The data are in `figures/campaigns`; the commands that made them stand in the files.
"""

from __future__ import annotations

import numpy as np

from figures import main, style
from figures.campaigns import grains
from figures.fig08a_rods import on_face
from figures.grains import over_beds
from geomech import plots
from rft.terradynamics.plates import Polygon, StressMap, loads

RULES = "keep", "cut"
BETA = np.radians(np.arange(181.0))
WAYS = "normal", "tangent"
CENTRES = {
    "round": 0.0,
    "half round": -grains.BAR / 2,
    "half round, flat up": grains.BAR / 2,
}  # m, of arcs over the axis


def compute() -> dict:
    """Return measured stresses, and lift over drag.

    "plates": by height, m, {"beta": (P,), rad, and by part, "face", "rear" and "whole", by way, "normal" and "tangent": (P,
    beds), N/cm^3}. "bar": {"beta": (R,), "normal", "tangent": (R, beds)} of the leading rows of the round bar. "maps": by rule
    {"zeta", "normal", "tangent": at `BETA`, N/cm^3, "misfit": rms difference from the net stress on plates and from the bar,
    each over its rms}. "bars": by name {"faces", "whole", "plates": (mean, error), "keep", "cut"}, lift over drag.
    """
    plates = measured_plates()
    faces = {name: leading_rows(name) for name in grains.BARS}
    main_plates = plates[grains.PLATES[0][0]]
    net = {way: main_plates["face"][way] + main_plates["rear"][way] for way in WAYS}
    maps = fitted(main_plates["beta"], net, faces["round"])
    bars = {
        name: lifts(name, rows, main_plates, maps) for name, rows in faces.items()
    } | {grains.SHELL: shell()}
    return {"plates": plates, "bar": faces["round"], "maps": maps, "bars": bars}


def measured_plates() -> dict:
    data = grains.read("plates")
    found = {}
    for height, tilts in grains.PLATES:
        mine = data["height_m"] == height
        of = lambda name: data[name][mine].reshape(len(tilts), -1)
        parts = {
            part: {way: of(f"{part}_{way}_N/cm3") for way in WAYS}
            for part in ("face", "rear", "whole")
        }
        found[height] = {"beta": np.radians(of("beta_deg")[:, 0]), **parts}
    return found


def leading_rows(name: str) -> dict:
    """Return the rows on the curved leading face of a bar, without corners and flat sides: {"beta", "weight": (R,), tilt, rad,
    and depth times area, m^3, "drag", "lift": (R, beds), N, "normal", "tangent": (R, beds), stress over depth, N/cm^3}. Rows
    that slide along themselves count half, as half of them leads."""
    data = grains.read("faces")
    mine = data["shape"] == name
    beds = len(np.unique(data["bed"][mine]))
    y, z, drag, lift = (
        data[key][mine].reshape(beds, -1).T
        for key in ("y_m", "z_m", "drag_N", "lift_N")
    )
    y, z = y[:, 0], z[:, 0] - CENTRES[name]
    kept = (y > -1e-6) & np.isclose(
        np.hypot(y, z), grains.BAR - grains.GRAIN, rtol=1e-3
    )
    if name != "round":
        kept &= ~np.isclose(
            np.abs(z), grains.GRAIN, rtol=1e-3
        )  # corners, where the arc meets the flat side
    beta = np.arctan2(np.maximum(y, 0.0), -z)
    rows = np.flatnonzero(kept)[np.argsort(beta[kept])]
    share, beta = np.where(y[rows] < 1e-6, 0.5, 1.0), beta[rows]
    area = share * grains.BAR * np.diff(beta).mean() * grains.TROUGH.length
    weight = area * (grains.BAR_DEPTH - CENTRES[name] + grains.BAR * np.cos(beta))
    drag, lift = share[:, None] * drag[rows], share[:, None] * lift[rows]
    sin, cos, over = (
        np.sin(beta)[:, None],
        np.cos(beta)[:, None],
        1e-6 / weight[:, None],
    )
    normal, tangent = (drag * sin + lift * cos) * over, (lift * sin - drag * cos) * over
    return {
        "beta": beta,
        "weight": weight,
        "drag": drag,
        "lift": lift,
        "normal": normal,
        "tangent": tangent,
    }


def fitted(beta: np.ndarray, net: dict, bar: dict) -> dict:
    """Return the maps by rule, with the zeta that fits net stress on plates best where the map pushes, and their misfits."""
    stacked = lambda some: np.concatenate([some[way].mean(1) for way in WAYS])
    at = lambda by_map, tilts: np.concatenate(
        [np.interp(tilts, BETA, by_map[way]) for way in WAYS]
    )
    unit = {
        rule: dict(zip(WAYS, on_face(StressMap(tension=rule), BETA))) for rule in RULES
    }
    x = at(unit["cut"], beta)
    zeta = float(x @ stacked(net) / (x @ x))
    maps: dict = {
        rule: {"zeta": zeta, **{way: zeta * unit[rule][way] for way in WAYS}}
        for rule in RULES
    }
    for by_map in maps.values():
        misfit = lambda tilts, y: float(
            np.sqrt(np.sum((y - at(by_map, tilts)) ** 2) / np.sum(y**2))
        )
        by_map["misfit"] = misfit(beta, stacked(net)), misfit(bar["beta"], stacked(bar))
    return maps


def summed(rows: dict, beta, normal, tangent) -> float:
    """Return lift over drag of stress over depth, (B,) at tilts beta, on the rows of a bar."""
    sin, cos = np.sin(rows["beta"]), np.cos(rows["beta"])
    sigma, tau = (
        rows["weight"] * np.interp(rows["beta"], beta, x) for x in (normal, tangent)
    )
    return float((sigma * cos + tau * sin).sum() / (sigma * sin - tau * cos).sum())


def lifts(name: str, rows: dict, plates: dict, maps: dict) -> dict:
    """Return lift over drag of a bar's leading curved face, of the whole bar, of plates and by the map."""
    whole = grains.read("lift")
    mine = whole["shape"] == name
    beds = whole["bed"][mine]
    face = [
        summed(rows, plates["beta"], sigma, tau)
        for sigma, tau in zip(plates["face"]["normal"].T, plates["face"]["tangent"].T)
    ]
    return {
        "faces": over_beds(rows["lift"].sum(0) / rows["drag"].sum(0), beds),
        "whole": over_beds(whole["lift_over_drag"][mine], beds),
        "plates": over_beds(np.array(face), beds),
        **{
            rule: summed(rows, BETA, *(maps[rule][way] for way in WAYS))
            for rule in RULES
        },
    }


def shell() -> dict:
    """Return lift over drag of half a round tube whose hollow leads, in grains and by the map, which sums over both sides."""
    data = grains.read("faces")
    mine = data["shape"] == grains.SHELL
    beds = np.unique(data["bed"][mine])
    drag, lift = (
        data[key][mine].reshape(len(beds), -1).sum(1) for key in ("drag_N", "lift_N")
    )
    phi = np.linspace(-np.pi / 2, np.pi / 2, 201)
    q = grains.BAR - grains.GRAIN
    sheet = Polygon(
        tuple(zip(-q * np.cos(phi), q * np.sin(phi))),
        grains.TROUGH.length,
        closed=False,
    ).outline(400)
    of = lambda rule: (
        loads(
            StressMap(tension=rule),
            sheet,
            [0, -grains.BAR_DEPTH, 0],
            [grains.SPEED, 0, 0],
        ).force
    )
    by_map = {
        rule: float(-force[1] / force[0]) for rule in RULES for force in [of(rule)]
    }
    return {
        "whole": over_beds(lift / drag, beds),
        "faces": (np.nan,) * 2,
        "plates": (np.nan,) * 2,
        **by_map,
    }


def table(numbers: dict) -> str:
    """Return stress on plates of two heights and lift over drag of bars."""
    rows = []
    for height, found in numbers["plates"].items():
        for k, beta in enumerate(np.degrees(found["beta"])):
            stress = [
                1e3 * found[part][way][k]
                for part in ("face", "rear", "whole")
                for way in WAYS
            ]
            cells = ["{:+.1f} +- {:.1f}".format(*mean(x)) for x in stress]
            rows.append((f"{1e3 * height:.0f} mm at {beta:.0f}", *cells))
    heads = [f"{part}, {way}" for part in ("face", "rear", "whole") for way in WAYS]
    plates = style.table(("stress / depth (kN/m3)", *heads), rows)
    told = lambda x: "-" if np.isnan(x[0]) else "{:+.2f} +- {:.2f}".format(*x)
    rows = [
        (
            name,
            *(told(x[key]) for key in MEASURED),
            *(f"{x[rule]:+.2f}" for rule in RULES),
        )
        for name, x in numbers["bars"].items()
    ]
    bars = style.table(
        ("lift over drag", *MEASURED.values(), "map", "tension cut"), rows
    )
    rows = [
        (rule, f"{x['zeta']:.4f}", *(f"{100 * off:.0f} %" for off in x["misfit"]))
        for rule, x in numbers["maps"].items()
    ]
    return f"{plates}\n{bars}\n{style.table(('tension', 'zeta', 'off plates', 'off the bar'), rows)}"


def mean(values: np.ndarray) -> tuple:
    """Return the mean over beds (..., beds) and its standard error."""
    return values.mean(-1), values.std(-1, ddof=1) / np.sqrt(values.shape[-1])


MEASURED = {"whole": "whole bar", "faces": "curved face", "plates": "plates over it"}


@plots.styled
def draw(numbers: dict):
    fig, axes = plots.figure(9.6, 3.1, 3)
    *stresses, right = axes[0]
    bar, plates = numbers["bar"], numbers["plates"]
    for ax, way in zip(stresses, WAYS):
        for rule, look in (("keep", "--"), ("cut", "-")):
            label = {"keep": "map", "cut": "tension cut"}[rule]
            ax.plot(
                np.degrees(BETA),
                1e3 * numbers["maps"][rule][way],
                look,
                color=style.BLUE,
                label=label,
            )
        (y, error), x = mean(1e3 * bar[way]), np.degrees(bar["beta"])
        ax.fill_between(x, y - error, y + error, color="0.75", lw=0)
        ax.plot(x, y, color="0.3", label="round bar")
        dots = {"ls": "none", "ms": 4, "capsize": 2}
        for (height, found), colour in zip(
            plates.items(), (style.VERMILION, style.PINK)
        ):
            x, size = np.degrees(found["beta"]), f"{1e3 * height:.0f} mm"
            ax.errorbar(
                x,
                *mean(1e3 * found["face"][way]),
                marker="o",
                color=colour,
                label=f"plates of {size}",
                **dots,
            )
            edged = {
                "marker": "o",
                "mfc": "white",
                "color": colour,
                "label": f"{size}, with edges",
                **dots,
            }
            ax.errorbar(x, *mean(1e3 * found["whole"][way]), **edged)
        style.zero_line(ax)
        ax.set(xlabel="tilt of the face (degrees)", xlim=(0, 180))
        ax.set_xticks(
            range(0, 181, 45), ["0\nunderside", 45, "90\nfront", 135, "180\ntop"]
        )
        ax.set(
            ylabel=f"{'normal' if way == 'normal' else 'tangential'} stress / depth (kN/m$^3$)"
        )
    stresses[0].legend(loc="lower left")
    y = np.arange(len(numbers["bars"]))
    bars = numbers["bars"].values()
    looks = (
        ("faces", "o", "0.3"),
        ("plates", "o", style.VERMILION),
        ("whole", "s", "0.6"),
    )
    for k, (key, marker, colour) in enumerate(looks):
        x, error = np.array([found[key] for found in bars]).T
        dots = {"ls": "none", "ms": 4, "capsize": 2, "label": MEASURED[key]}
        right.errorbar(
            x, y + 0.15 * (k - 1), xerr=error, marker=marker, color=colour, **dots
        )
    for rule, marker, label in (("keep", "D", "map"), ("cut", "^", "tension cut")):
        right.plot(
            [found[rule] for found in bars],
            y,
            marker,
            mfc="white",
            color=style.BLUE,
            label=label,
        )
    right.axvline(0.0, **style.GUIDE)
    right.set_yticks(y, [name.replace(", ", ",\n") for name in numbers["bars"]])
    right.set(xlabel="lift over drag", ylim=(len(y) - 0.5, -1.6), xlim=(-1.2, 1.8))
    right.legend(loc="upper left", ncols=2, columnspacing=0.5)
    style.letter_panels(axes)
    return fig


if __name__ == "__main__":
    main("grain_plates", compute, draw, table)
