"""Fig. 10: muscle activation of a swimming sandfish, predicted by the internal moment that holds against the sand.

The sign of the moment is taken for the side that is active (paper Sec. III C). Left: over the body and a cycle, where the
left side is active, and where it shortens (curvature to the left grows). Right: speed of the wave of moment over that of
the wave of curvature, against the number of waves on the body.
"""

from __future__ import annotations

import dataclasses

import numpy as np

from figures import main
from geomech import plots
from geomech.gaits import Sine
from geomech.scene import load
from rft import Backbone

WAVES = (0.5, 0.75, 1.0, 1.25, 1.5, 1.8)


def compute(amplitude: float = 0.22, elements: int = 80, phases: int = 128) -> dict:
    """s (S,) from tail to head; t (T,), share of a cycle; moment and bend rate (T, S) for one wave; onset and offset of
    left activation and lag (rad, of the fundamental) behind the curvature, (S,); "waves" and "speed" ratios."""
    out = activation(1.0, amplitude, elements, phases)
    ratios = [activation(w, amplitude, elements, phases)["speed_ratio"] for w in WAVES]
    return {**out, "waves": np.array(WAVES), "speed": np.array(ratios)}


def activation(waves: float, amplitude: float, elements: int, phases: int) -> dict:
    """The moment along a body of that many waves through a cycle, in loose glass, ends left out."""
    sandfish = load("sandfish-loose")
    gait = Sine(waves=waves, amplitude=amplitude, elements=elements)
    scene = dataclasses.replace(sandfish, gait=gait, body=Backbone(elements), effects=())
    alpha, alphadot = gait.cycle(phases)
    moment = scene.work(alpha, alphadot, scene.velocity(alpha, alphadot)).moment
    s = np.arange(1, elements) / elements
    torque, bend = (np.fft.fft(x, axis=0)[1] for x in (moment, alpha))
    middle = (s > 0.1) & (s < 0.9)  # at the ends the moment vanishes
    slopes = [np.polyfit(s[middle], np.unwrap(np.angle(x[middle])), 1)[0] for x in (torque, bend)]
    lead = np.unwrap(np.angle(torque / bend))
    lead -= 2 * np.pi * np.round(lead[len(lead) // 2] / (2 * np.pi))
    onset = np.mod(-np.angle(torque) / (2 * np.pi) - 0.25, 1.0)
    return {
        "s": s,
        "t": np.arange(phases) / phases,
        "moment": moment,
        "bend_rate": alphadot,
        "onset": onset,
        "offset": np.mod(onset + 0.5, 1.0),
        "lead": lead,
        "speed_ratio": float(slopes[1] / slopes[0]),
    }


@plots.styled
def draw(numbers: dict):
    fig, axes = plots.figure(8.2, 3.0, 2)
    left, right = axes[0]
    s, t = numbers["s"], numbers["t"]
    left.contourf(s, t, numbers["moment"] > 0, levels=[0.5, 1.5], colors=["#009E73"], alpha=0.55)
    left.contourf(s, t, numbers["bend_rate"] > 0, levels=[0.5, 1.5], colors="none", hatches=["//"])
    left.plot([], [], "s", color="#009E73", alpha=0.55, label="left side active")
    left.plot([], [], "s", mfc="none", color="0.4", label="hatched: bending left")
    left.set(xlabel="place on the body, tail 0 to head 1", ylabel="time / period", xlim=(0.02, 0.98), ylim=(0, t[-1]))
    left.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=2)
    right.plot(numbers["waves"], numbers["speed"], "o-", color="black")
    right.axhline(1.0, color="0.7", lw=0.6)
    right.set(xlabel="waves on the body", ylabel="speed of moment / curvature wave", ylim=(0, None))
    return fig


if __name__ == "__main__":
    main("fig10", compute, draw)
