"""The words for results of midlines."""

import math

from geomech.core.variables import Result
from geomech.questions.shared import tools
from geomech.results.show import scalar

SHOWN = (
    "frequency", "body_length", "speed", "stride", "heading", "turn", "slip",
    "efficiency", "amplitude", "wavelength",
)  # fmt: skip


def headline(result: Result) -> list[str]:
    facts = result.attributes
    noise = result["noise"]
    cycles = f"{facts['cycles']} full cycles of {facts['points']} points"
    first = f"{facts['file']}: {cycles}"
    left_out = facts["cycles_left_out"]
    if left_out == 1:
        first = f"{first}; 1 cycle with gaps left out"
    elif left_out:
        first = f"{first}; {left_out} cycles with gaps left out"
    return [
        first,
        f"head: {facts['head']}",
        f"smoothed by {facts['modes']} modes along the body and "
        f"{facts['knots_per_cycle']:.3g} knots per cycle, more than cross-validation "
        f"chose; noise of a point {float(noise):.2g} {noise.unit}",
        f"with {100 * facts['level']:.3g} % confidence intervals:",
    ]


def summary(result: Result) -> Result:
    """Return the quantities and, of a prediction, what is measured and what is
    predicted side by side."""
    shown = result.only(*SHOWN)
    if "compared" not in result:
        return shown
    names = result["compared"].values.tolist()
    predicted = [f"{name}_predicted" for name in names]
    return shown.with_variables(
        result["compared"],
        tools.side_by_side(result, "measured", "compared", names),
        tools.side_by_side(result, "predicted", "compared", predicted),
    )


def remarks(result: Result) -> list[str]:
    lines = []
    if "compared" in result:
        names = result["compared"].values
        agrees = result["apart"].values <= 1
        for verb, chosen in (("agree", names[agrees]), ("differ", names[~agrees])):
            if chosen.size:
                lines.append(f"measured and predicted {verb}: {', '.join(chosen)}")
    if "parameter" in result:
        for name in result["parameter"].values.tolist():
            lines.append(closing_words(result, name))
    return lines


def closing_words(result: Result, name: str) -> str:
    """Return which value of a parameter of the medium gives the measured distance."""
    one = result.at(parameter=name)
    present = one["parameter_present"]
    closing = one["parameter_closing"]
    words = f"{name} = {scalar(tools.in_degrees(present))}"
    if math.isfinite(float(closing)):
        value = scalar(tools.in_degrees(closing))
        return f"{words}: {value} reproduces the measured distance"
    tried = tools.in_degrees(one["parameter_tried"])
    low, high = (float(f"{x:.3g}") for x in tried.values)
    span = f"{low:g} to {high:g}"
    if tried.unit != "1":
        span = f"{span} {tried.unit}"
    return f"{words}: no value from {span} reproduces the measured distance"
