"""Forces along an undulating body over a cycle of its gait: thrust and drag, power,
bending moment, activation."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any, ClassVar

from geomech.core.variables import Result
from geomech.questions.shared import loading, names, parsing
from geomech.questions.shared.base import Option, Question, Run, Subject
from geomech.questions.shared.common import ColourLimit
from geomech.results.show import scalar
from geomech.runs.cost import Cost
from rft.core.refusal import Refusal

if TYPE_CHECKING:
    from geomech.scenes.model import Scene
    from geomech.studies.mechanics.newtons import Sizes

PANELS = f"panels among {','.join(parsing.FORCE_PANELS)}"
# Variables that are places on the body, tail 0 to head 1, whatever its length.
SHARES = ("s", "point", "joint", "place", "length", "largest_moment_s")
EQUAL = 1e-6  # relative difference up to which powers are called the same


@dataclass(frozen=True)
class Forces(Question):
    """Compute force, power and bending moment along the body. Forces are in newtons if
    length, radius and depth of the body are known, otherwise in units of the axial drag
    of the straight body."""

    scene: Annotated[
        "Scene", Subject(loading.load_scene, names.scene_names, ("medium",))
    ]
    length: Annotated[float | None, Option("length of the body in m", "M")] = None
    radius: Annotated[float | None, Option("radius of the body in m", "M")] = None
    depth: Annotated[float | None, Option("depth of the body in m", "M")] = None
    stress: Annotated[
        float | None,
        Option("axial drag over 2 radius x length at that depth, in Pa", "PA"),
    ] = None
    frequency: Annotated[float | None, Option("cycles per second", "HZ")] = None

    name: ClassVar[str] = "forces"
    looks: ClassVar[tuple[str, ...]] = (*Question.looks, "unit", "cmap")
    table: ClassVar[tuple[str, ...]] = ("phase", "s")

    @property
    def title(self) -> str:
        return f"forces on {self.scene.name}"

    @property
    def sizes(self) -> "Sizes":
        from geomech.studies.mechanics.newtons import Sizes

        return Sizes(self.length, self.radius, self.depth, self.stress, self.frequency)

    def check(self) -> None:
        from geomech.studies.mechanics import forces

        forces.check(self.scene, self.sizes)

    def check_unit(self, unit: str) -> None:
        from geomech.core.errors import choose
        from geomech.results.length_units import UNITS
        from geomech.studies.mechanics import forces

        choose("``unit``", unit, UNITS)
        if unit != "BL" and forces.body_length(self.scene, self.sizes) is None:
            raise Refusal(
                f"lengths of {self.scene.name} are in body lengths",
                where="``unit``",
                value=unit,
                instead="give the ``length`` of the body in m, or unit BL",
            )

    def cost(self) -> Cost:
        from geomech.studies.mechanics import forces

        return forces.cost(self.scene)

    def compute(self, run: Run) -> Result:
        from geomech.studies.mechanics import forces

        return forces.answer(self.scene, self.sizes)

    @staticmethod
    def lengths(result: Result) -> Any:
        from geomech.results.length_units import Lengths
        from geomech.results.scenes import scene_of
        from geomech.studies.mechanics import forces

        sizes = forces.NO_SIZES
        if result.question is not None:
            sizes = result.question.sizes
        body = forces.body_length(scene_of(result), sizes)
        return Lengths({"BL": body, "m": 1.0}, body, kept=SHARES)

    @staticmethod
    def headline(result: Result) -> list[str]:
        name = result.attributes["scene"]
        if not result.attributes["travels"]:
            where = "forwards is the direction of the frame at phase 0"
            return [f"{name}: no net displacement; {where}"]
        distance = result["net_distance"]
        degrees = math.degrees(float(result["direction"]))
        return [
            f"{name}: {float(distance):.4g} {distance.unit} per cycle, {degrees:.1f} "
            "degrees from the heading of the frame at phase 0"
        ]

    @staticmethod
    def summary(result: Result) -> Result:
        return result.only("thrust", "drag")

    @staticmethod
    def remarks(result: Result) -> list[str]:
        return [
            "thrust and drag: means over the cycle, in the direction of travel",
            power_words(result),
            moment_words(result),
            activation_words(result),
            f"unit of force: {result.attributes['drag_is']}",
        ]

    @staticmethod
    def draw(
        result: Result,
        *,
        component: Annotated[
            Sequence[str], Option(PANELS, "NAMES", parsing.force_panels)
        ] = (),
        clim: ColourLimit = None,
    ) -> Any:
        """Draw maps over place and phase, and thrust and drag stacked; return the
        Figure."""
        from geomech import plots

        return plots.forces_figure(result, component, clim=clim)


def power_words(result: Result) -> str:
    power = result["mean_power"]
    largest = float(result["largest_power"])
    joints = float(result["mean_joint_power"])
    at_joints = f"at the joints {joints:.4g} {power.unit}"
    if abs(joints - float(power)) <= EQUAL * max(abs(largest), 1e-300):
        at_joints = "at the joints the same"
    return f"power {scalar(power)} into the medium, at most {largest:.4g}; {at_joints}"


def moment_words(result: Result) -> str:
    moment = result["largest_moment"]
    place = float(result["largest_moment_s"])
    phase = float(result["largest_moment_phase"])
    return (
        f"largest bending moment {float(moment):.4g} {moment.unit}, "
        f"at s = {place:.3g} (head 1) and phase {phase:.3g} rad"
    )


def activation_words(result: Result) -> str:
    lags = result["lag_of_activation"].values
    places = result["place"].values
    lag_list = ", ".join(f"{lag:.3g}" for lag in lags)
    place_list = ", ".join(f"{place:.3g}" for place in places)
    words = f"activation leads bending by {lag_list} rad at s = {place_list}"
    ratio = float(result["fundamental_speed_ratio"])
    if len(lags) > 1 and math.isfinite(ratio):
        wave = f"its wave is {ratio:.3g} times as fast as the wave of curvature"
        words = f"{words}; {wave}"
    return words
