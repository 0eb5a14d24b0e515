"""The words for results of logs of joint angles."""

from dataclasses import replace

from geomech.core.variables import POSE, Result, Variable
from geomech.questions.shared import tools

QUALITY = ("difference", "scatter")  # by component


def headline(result: Result) -> list[str]:
    facts = result.attributes
    frequency = float(result["frequency"])
    residual = float(result["phase_residual"])
    cycles = f"{facts['cycles']} full cycles of {facts['columns']}"
    return [
        f"{facts['file']}: {cycles}, {frequency:.6g} per unit of t",
        f"phase within {residual:.2g} rad of uniform progress through each cycle",
        (
            f"displacement per cycle, with {100 * facts['level']:.3g} % confidence "
            "intervals:"
        ),
    ]


def summary(result: Result) -> Result:
    """Return the displacements as logged and as predicted, side by side."""
    predicted = [f"{name}_predicted" for name in POSE]
    shown = [
        Variable("pose", ("pose",), POSE),
        tools.side_by_side(result, "logged", "pose", POSE),
        tools.side_by_side(result, "predicted", "pose", predicted),
    ]
    for name in QUALITY:
        shown.append(replace(result[name], dims=("pose",)))
    return result.only().with_variables(*shown)


def remarks(result: Result) -> list[str]:
    count = int(result["harmonics"].values)
    harmonics = "1 harmonic"
    if count != 1:
        harmonics = f"{count} harmonics"
    reach = result["reach_along"].values
    parts = []
    for name, share in zip(POSE, result["explained"].values):
        parts.append(f"{name} {100 * share:.3g} %")
    return [
        (
            "difference: rms between logged and predicted cycles; scatter: rms of the "
            "logged cycles"
        ),
        f"explained share of the body velocity: {', '.join(parts)}",
        f"connection: {harmonics} in phase; the data extend {reach.min():.3g} to "
        f"{reach.max():.3g} rad from the mean gait",
        f"status: {result.attributes['status']}",
    ]
