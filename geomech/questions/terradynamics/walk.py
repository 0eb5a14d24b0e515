"""How a robot walks on grains: its motion from rest, and the means of its limit cycle
with their errors."""

import math
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, ClassVar

import numpy as np

from geomech.core.variables import Result
from geomech.questions.shared import loading, names
from geomech.questions.shared.base import Option, Question, Run, Subject
from geomech.questions.shared.tools import FILMS, check_films
from geomech.results.show import scalar
from geomech.runs.cost import LONGEST, Cost

if TYPE_CHECKING:
    from geomech.scenes.terradynamics.walker import WalkerScene

WALKING = "walking"  # status of a robot that neither sank nor fell
ANGLES = {"pitch": "nose down", "roll": "left side up", "yaw": "turning left"}


def write_film(
    path: Path,
    result: Result,
    *,
    follow: Annotated[bool, Option("let the camera of the film follow the robot")] = (
        False
    ),
) -> None:
    """Write a film of the walk."""
    from geomech.plots import films

    films.write_walk(path, result, follow)


@dataclass(frozen=True)
class Walk(Question):
    """Compute how a robot walks on grains. The robot starts from rest, and its mean
    speed has an estimated error. Results are in SI units; pitch is in rad, positive
    nose down."""

    scene: Annotated["WalkerScene", Subject(loading.load_walker, names.walker_names)]
    engine: Annotated[
        str | None, Option("planar or mujoco, instead of the scene's", "ENGINE")
    ] = None

    name: ClassVar[str] = "walk"
    looks: ClassVar[tuple[str, ...]] = (*Question.looks, "unit")
    table: ClassVar[tuple[str, ...]] = ("t",)

    def check(self) -> None:
        from geomech.studies.terradynamics import walking

        walking.refuse_engine(self.scene, self.engine)

    def for_files(self, paths: list[Path], options: dict[str, Any]) -> Question:
        check_films(paths)
        return self

    def cost(self) -> Cost:
        from geomech.studies.terradynamics import walking

        return walking.walk_cost(self.scene, engine_name=self.engine)

    def compute(self, run: Run) -> Result:
        from geomech.studies.terradynamics import walking

        longest = math.inf
        if run.limited:
            longest = LONGEST
        found = walking.run(self.scene, self.engine, run.progress, longest)
        return Result("walk", tuple(walking.variables(self.scene, found)))

    @staticmethod
    def files() -> dict[str, Any]:
        return dict.fromkeys(FILMS, write_film)

    @staticmethod
    def headline(result: Result) -> list[str]:
        name = result.attributes["scene"]
        status = str(result["status"].values)
        speed = scalar(result["speed"])
        cycle = "no limit cycle found: mean over the computed time"
        if result["periodic"].values:
            cycle = f"limit cycle{settling_words(result)}"
        elif "step_length" in result:
            cycle = "mean over the last cycles: the ground remembers the steps"
        frequency = float(result["frequency"])
        return [f"{name}: {status} at {speed} at {frequency:g} Hz ({cycle})"]

    @staticmethod
    def summary(result: Result) -> Result:
        shown = ["slip", "sinkage", "total_work", "total_loss", "cost_of_transport"]
        if "uphill" in result:
            shown = ["uphill", *shown]
        if str(result["status"].values) != WALKING:
            shown.remove("cost_of_transport")
        if "yaw" in result:
            shown = ["lateral_speed", "yaw_rate", *shown]
        return result.only(*shown)

    @staticmethod
    def remarks(result: Result) -> list[str]:
        steps = float(result["speed_error_of_steps"])
        elements = float(result["speed_error_of_elements"])
        share = 100 * float(result["unaccounted"])
        unit = result["speed"].unit
        lines = [
            outcome_words(result),
            motion_words(result),
            f"of the error, {steps:.1g} {unit} come from the steps and {elements:.1g} "
            f"{unit} from the elements",
            (
                f"energy balance of the steps: {share:.2g} % of the work is "
                "unaccounted for"
            ),
        ]
        if "step_length" in result and result["step_length"].values.size:
            lines.insert(1, step_words(result))
        unsolved = int(result["unsolved"].values)
        if unsolved:
            residual = float(result["residual"])
            speed_error = float(result["speed_error_of_unsolved"])
            lines.append(
                f"{unsolved} steps did not converge, with residuals up to "
                f"{residual:.1g} {result['residual'].unit}, which change the speed by "
                f"{speed_error:.1g} {unit}: raise [numerics] steps or rounding"
            )
        return lines

    @staticmethod
    def draw(
        result: Result,
        *,
        strip: Annotated[bool, Option("draw pictures of the last cycle")] = False,
    ) -> Any:
        """Draw speed, height and pitch in time, and the robot at its end, or the last
        cycle in pictures; return the Figure."""
        from geomech import plots

        if strip:
            return plots.walk_strip(result)
        return plots.walk_figure(result)


def settling_words(result: Result) -> str:
    """Return the time that a robot takes from rest to the limit cycle, in words."""
    from geomech.studies.terradynamics.walking import NEAR

    if "settling_time" not in result:
        return ""
    time = float(result["settling_time"])
    within = f"within {100 * NEAR:g} % of it"
    if math.isinf(time):
        return f"; starting from rest it does not come {within}"
    if time == 0:
        return f"; {within} from the start"
    return f"; starting from rest it is {within} after {time:.2g} s"


def outcome_words(result: Result) -> str:
    """Return the outcome of a walk with its definition."""
    from geomech.studies.terradynamics.outcome import OUTCOMES

    name = str(result["outcome"].values)
    return f"{name}: {OUTCOMES[name]}"


def step_words(result: Result) -> str:
    """Return how the steps change, and the ground that they meet."""
    lengths = result["step_length"]
    strengths = result["step_strength"].values
    first, last = lengths.values[0], lengths.values[-1]
    return (
        f"progress per cycle: {first:.3g} {lengths.unit} in the first, {last:.3g} "
        f"{lengths.unit} in the last of {len(strengths)}; strength of the ground under "
        f"the limbs: {strengths[0]:.3g} to {strengths[-1]:.3g}"
    )


def motion_words(result: Result) -> str:
    """Return where the robot went and how far it turned."""
    t, x, z = (result[name].values for name in ("t", "x", "z"))
    unit = result["x"].unit
    words = f"t = 0 to {t[-1]:.4g} s: x to {x[-1]:.4g} {unit}"
    if "y" in result:
        words = f"{words}, y to {result['y'].values[-1]:.2g} {unit}"
    words = f"{words}, z {z.min():.4g} to {z.max():.4g} {unit}"
    for name, positive in ANGLES.items():
        if name in result:
            degrees = np.degrees(result[name].values)
            span = f"{degrees.min():.3g} to {degrees.max():.3g} degrees"
            words = f"{words}, {name} {span} ({positive} +)"
    return words
