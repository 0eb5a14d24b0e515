"""Fig. 10: muscle activation of a swimming sandfish, as predicted from the internal
moment against the resistance of the sand.

The sign of the moment tells which side works, as in Sec. III C
(`geomech.studies.mechanics.undulation.activation`). Lines are for a plain body with the
amplitude of the animal in loose glass beads; dashed lines in (d) include the head drag
of the sandfish.

(a) As Fig. 10(c): the lines show where the right side starts and stops working, over
the shaded part of the cycle in which curvature to the left decreases. (b) As Fig.
10(b): curvature and moment at one place. The caption gives the place x = 0.71 pi, from
an origin that it does not name; here the place is 70 % of the way from head to tail.
The right side starts there before the body is bent most to the left. (c) Phase by which
activation is ahead of curvature. It is pi / 2 where the side that works is the side
that shortens, as at the middle of a body with equal halves fore and aft. It is larger
towards the tail; this is the advance that Sec. III C describes. (d) Speed of the wave
of activation over the speed of the wave of curvature.

The ratio is above 1: the wave of activation is faster, as Sec. III C says of nearly all
undulating animals. The same section later calls its phase speed the smaller one,
because it takes the speed for the inverse of a slope. The smaller quantity here is the
slope of the lines in (a), time over place, not its inverse. From 0.5 to 1.8 waves the
ratio falls, but not evenly: between 1 and 1.4 waves it is level to 5 % by the lines of
onset and offset, with a shallow dip, and rises by 10 % by the first harmonic. As the
lines are not straight, the ratio depends on the part of the body over which they are
fitted: over 0.2 to 0.8 of the body instead of 0.1 to 0.9 it is lower by up to 0.3, with
the same dip. A comparison with electromyography would need the data of the animals.
"""

from __future__ import annotations

import numpy as np

from figures import main, style
from geomech import plots
from geomech.mathematics.gaits import Sine
from geomech.scenes import load
from geomech.studies.mechanics import undulation
from rft import Backbone

WAVES = np.linspace(0.5, 1.8, 27)
SELECTED = (0.5, 0.75, 1.0, 1.25, 1.5, 1.8)  # of the lags and the table
PLACE = 0.3  # of the trace in time: 70 % of the way from head to tail
PLACES = (0.25, 0.5, 0.75)  # of the table
BOUNDS = (("onset", "-"), ("offset", "--"))  # of the work of the right side


def compute(waves=WAVES, elements: int = 100, phases: int = 128) -> dict:
    """Return the activation of a sandfish in loose glass at the scene's A / lambda,
    with ``waves`` (W,) on its body.

    Without head drag: "waves": (W,). "s": (S,), tail 0 to head 1. "lag": (W, S), rad.
    "speed", "fundamental_speed": (W,), ratios by the lines of onset and offset and by
    the first harmonic. "one": all of `undulation.activation` for one wave.
    "head": {"lag", "speed", "fundamental_speed"}, the same with head drag.
    """
    fish = load("sandfish-loose").with_numerics(phases=phases)

    def activation(n_waves, effects):
        gait = Sine(waves=n_waves, amplitude=fish.gait.amplitude, elements=elements)
        body = Backbone(elements)
        return undulation.activation(
            fish.changed(body=body, effects=effects, gait=gait)
        )

    headless = [activation(n, ()) for n in waves]
    head = [activation(n, fish.system.effects) for n in waves]
    one = activation(1.0, ())
    return {
        "waves": np.array(waves),
        "s": one["s"],
        **wave_measures(headless),
        "one": one,
        "head": wave_measures(head),
    }


def wave_measures(activations: list[dict]) -> dict:
    """Return "lag" (W, S), "speed" and "fundamental_speed" (W,) of activations."""
    return {
        "lag": np.array([x["lag"] for x in activations]),
        "speed": np.array([x["speed_ratio"] for x in activations]),
        "fundamental_speed": np.array(
            [x["fundamental_speed_ratio"] for x in activations]
        ),
    }


def selected_rows(numbers: dict) -> list[int]:
    """Return the rows of the waves in SELECTED."""
    return [k for k, n in enumerate(numbers["waves"]) if np.isclose(n, SELECTED).any()]


def table(numbers: dict) -> str:
    """Return speed ratios and the phase by which activation is ahead of curvature at
    three places."""
    heads = (
        "waves",
        "speed ratio: lines",
        "harmonic",
        "lines, head drag",
        *(f"ahead at s = {s} (rad)" for s in PLACES),
    )
    columns = (
        numbers["waves"],
        numbers["speed"],
        numbers["fundamental_speed"],
        numbers["head"]["speed"],
    )
    lags = np.array([np.interp(PLACES, numbers["s"], lag) for lag in numbers["lag"]])
    rows = []
    for row in np.column_stack([*columns, lags])[selected_rows(numbers)]:
        rows.append([f"{x:.2f}" for x in row])
    return style.table(heads, rows)


@plots.styled
def draw(numbers: dict):
    """Draw the map of activation, the trace at a place, lags and speeds."""
    fig, axes = plots.figure(6.7, 5.6, 2, 2)
    draw_map(axes[0, 0], numbers["one"])
    draw_trace(axes[0, 1], numbers["one"])
    draw_lag(axes[1, 0], numbers)
    draw_speed(axes[1, 1], numbers)
    style.letter_panels(axes)
    return fig


def draw_map(ax, one: dict) -> None:
    """Draw onset and offset along the body over the part of the cycle in which
    curvature falls."""
    s = one["s"]
    t = np.append(one["t"], 2 * np.pi)
    rate = np.concatenate([one["bend_rate"], one["bend_rate"][:1]])
    ax.contourf(s, t, rate, levels=[-np.inf, 0.0], colors=[style.SHADED["color"]])
    for key, dashes in BOUNDS:
        look = {"color": style.GREEN, "ls": dashes}
        # The lines leave the cycle and come back into it.
        ax.plot(s, one[key] - 2 * np.pi, **look)
        ax.plot(s, one[key], label=f"{key} of right side", **look)
        ax.plot(s, one[key] + 2 * np.pi, **look)
    ax.fill([], [], label="bending to the right", **style.SHADED)
    ax.set(xlabel="place on the body, tail 0 to head 1", xlim=(0, 1))
    style.set_phase_axis(ax, "y")
    ax.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0))


def draw_trace(ax, one: dict) -> None:
    """Draw curvature and moment over a cycle at PLACE, each over its largest value, and
    the span in which the right works."""
    k = np.abs(one["s"] - PLACE).argmin()
    t = np.append(one["t"], 2 * np.pi)
    looks = (
        ("bend", style.BLUE, 1.0, "curvature, + to the left"),
        ("moment", style.GREEN, 2.0, "moment, + left side works"),
    )
    for key, colour, width, label in looks:
        trace = np.append(one[key][:, k], one[key][0, k])
        ax.plot(t, trace / np.abs(trace).max(), color=colour, lw=width, label=label)
    falls = np.append(one["bend_rate"][:, k], one["bend_rate"][0, k]) < 0
    shade = {"label": "bending to the right", **style.SHADED}
    ax.fill_between(t, -1.1, 1.1, where=falls, **shade)
    for key, dashes in BOUNDS:
        phase = np.mod(one[key][k], 2 * np.pi)
        ax.axvline(phase, color=style.GREEN, ls=dashes, lw=1.0)
    style.draw_zero_line(ax)
    ax.set(ylabel=f"over its largest value, at s = {PLACE}", ylim=(-1.1, 1.1))
    style.set_phase_axis(ax)
    ax.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0))


def draw_lag(ax, numbers: dict) -> None:
    """Draw the phase by which activation is ahead, along the body."""
    rows = selected_rows(numbers)
    for k, colour in zip(rows, style.shades(len(rows))):
        label = f"{numbers['waves'][k]:g}"
        ax.plot(numbers["s"], numbers["lag"][k], color=colour, label=label)
    ax.axhline(np.pi / 2, **style.GUIDE)
    ax.text(0.02, np.pi / 2 - 0.08, "works while\nit shortens", va="top", **style.NOTE)
    ax.set(
        xlabel="place on the body, tail 0 to head 1",
        ylabel="activation ahead of curvature (rad)",
        xlim=(0, 1),
    )
    style.set_quarter_ticks(ax, "y", 4)
    ax.legend(title="waves on the body", loc="upper right", ncols=2)


def draw_speed(ax, numbers: dict) -> None:
    """Draw the ratio of speeds against the number of waves."""
    waves = numbers["waves"]
    head = numbers["head"]
    looks = (
        ("speed", "o", style.BLACK, "onset, offset"),
        ("fundamental_speed", "^", style.VERMILION, "first harmonic"),
    )
    for key, marker, colour, label in looks:
        look = {"color": colour, "marker": marker, "markevery": 4}
        ax.plot(waves, numbers[key], label=label, **look)
        ax.plot(waves, head[key], ls="--", lw=1.0, **look)
    style.add_entry(ax, "with head drag", ls="--", lw=1.0)
    ax.axhline(1.0, **style.GUIDE)
    ax.set(
        xlabel="waves on the body",
        ylabel="speed of activation / curvature",
        ylim=(0, None),
    )
    ax.legend(loc="lower left")


if __name__ == "__main__":
    main("fig10", compute, draw, table)
