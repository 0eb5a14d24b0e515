"""A medium fitted to measured drag: a force law from a rod, a stress map from plates,
or the strength of one from a plate that is pushed straight down."""

from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Annotated, Any, ClassVar

from geomech.core.variables import Result
from geomech.io.files import write_text
from geomech.questions.shared import loading, names, parsing, tools
from geomech.questions.shared.base import Option, Question, Run, Subject

HELP = "CSV file, or a sample: short-rod-drag, flank-drag"
SIZES = ("radius", "length", "depth", "density", "area")
# Laws of the vertical plane.
MAP = "stress-map"
STRENGTH = "zeta"
LARGEST_SHOWN = 10  # measurements that are shown beside the fit
OF_ROD = ("axial_force", "axial_stress", "rms", "repeats_rms")
# By the columns of shown measurements: their variable, and its component.
ROWS = {
    "along": ("force", "parallel"),
    "law_along": ("fitted", "parallel"),
    "across": ("force", "perpendicular"),
    "law_across": ("fitted", "perpendicular"),
}
DRAGS = {
    "alpha_x": ("stress", "alpha_x"),
    "map_x": ("fitted", "alpha_x"),
    "alpha_z": ("stress", "alpha_z"),
    "map_z": ("fitted", "alpha_z"),
}


def write_medium(path: Path, result: Result) -> None:
    """Write the medium as a file for scenes."""
    write_text(path, result.attributes["medium_toml"])


@dataclass(frozen=True)
class FitMedium(Question):
    """Fit a medium to your own drag data. The columns of the file decide what is
    fitted: psi_deg, F_parallel_N, F_perpendicular_N of a dragged rod give a force law;
    beta, gamma, alpha_x, alpha_z (degrees, N/cm^3) of plates in the vertical plane give
    nine coefficients; depth_m, force_N of a plate pushed straight down give the factor
    zeta. -o FILE.toml writes the medium."""

    drag: Annotated[
        str, Subject(loading.as_typed, names.drag_names, (), "DRAG.csv", HELP)
    ]
    law: Annotated[
        str | None,
        Option(
            "granular, viscous, coulomb, stress-map, zeta (default by columns)", "LAW"
        ),
    ] = None
    end_caps: Annotated[
        float | str,
        Option(
            "ends: left-out (default), fitted, or 1 for a flat end",
            "E",
            parsing.end_caps,
        ),
    ] = 0.0
    radius: Annotated[
        float | None,
        Option("radius of the rod in m, instead of the file's", "SIZE"),
    ] = None
    length: Annotated[
        float | None,
        Option("length of the rod in m, instead of the file's", "SIZE"),
    ] = None
    depth: Annotated[
        float | None,
        Option("depth of the rod's axis in m, instead of the file's", "SIZE"),
    ] = None
    density: Annotated[
        float | None,
        Option("density of the bed in kg/m^3, instead of the file's", "SIZE"),
    ] = None
    area: Annotated[
        float | None,
        Option("area of the plate in m^2, instead of the file's", "SIZE"),
    ] = None

    name: ClassVar[str] = "fit_medium"
    looks: ClassVar[tuple[str, ...]] = (*Question.looks, "cmap")
    table: ClassVar[tuple[str, ...]] = ("parameter",)

    def __post_init__(self) -> None:
        self._set(drag=str(self.drag))

    def inputs(self) -> list[Path]:
        return [Path(self.drag)]

    @cached_property
    def chosen_law(self) -> str:
        from geomech.studies.terradynamics import calibration

        return calibration.chosen_law(self.drag, self.law)

    def check(self) -> None:
        _ = self.chosen_law  # refuses an unknown one

    def compute(self, run: Run) -> Result:
        from geomech.studies.terradynamics import calibration

        given = {name: getattr(self, name) for name in SIZES}
        sizes = {name: size for name, size in given.items() if size is not None}
        return calibration.answer(self.drag, self.chosen_law, sizes, self.end_caps)

    def ask(self, tables: Any = None) -> Result:
        result = super().ask(tables)
        tools.warn_of_notes(result)
        return result

    @staticmethod
    def files() -> dict[str, Any]:
        return {".toml": write_medium}

    @staticmethod
    def headline(result: Result) -> list[str]:
        facts = result.attributes
        law = facts["law"]
        name = facts["file"]
        if law == MAP:
            return [f"stress map fitted to {name}: {facts['drags']} plate drags"]
        if law == STRENGTH:
            depth = result["depth"].values
            to = f"{1e2 * depth[-1]:.3g} cm"
            return [f"zeta fitted to {name}: {depth.size} depths to {to}"]
        size = f"{facts['forces']} forces at {facts['angles']} angles"
        return [f"{law} law fitted to {name}: {size}"]

    @staticmethod
    def summary(result: Result) -> Result:
        law = result.attributes["law"]
        if law == MAP:
            shown = result.only("value", "share_from_data", "generic", "zeta", "rms")
            return with_rows(shown, result, ("beta", "gamma"), DRAGS)
        if law == STRENGTH:
            shown = result.only("value", "downward_stress", "rms")
            if result["depth"].values.size <= LARGEST_SHOWN:
                rows = result.only("depth", "force", "fitted").variables
                shown = shown.with_variables(*rows)
            return shown
        parameters = result["parameter"].values.tolist()
        others = [name for name in OF_ROD if name not in parameters]
        return with_rows(result.only("value", *others), result, ("psi",), ROWS)

    @staticmethod
    def remarks(result: Result) -> list[str]:
        law = result.attributes["law"]
        lines = ["errors are half widths of 95 % confidence intervals"]
        if law == MAP:
            lines += [
                f"the map {result.attributes['map']}",
                *undetermined_words(result),
            ]
        elif law != STRENGTH:
            lines += rod_words(result)
        scene = "a scene"
        if law in (MAP, STRENGTH):
            scene = "an intruder scene"
        return [
            *lines,
            f'to use it in {scene}: -o FILE.toml, then [medium] file = "FILE.toml"',
        ]

    @staticmethod
    def draw(result: Result) -> Any:
        """Draw the measurements with the fit, and the residuals; return the Figure."""
        from geomech import plots

        law = result.attributes["law"]
        if law == MAP:
            return plots.plates_figure(result)
        if law == STRENGTH:
            return plots.penetration_figure(result)
        return plots.drag_figure(result)


def with_rows(
    shown: Result,
    result: Result,
    places: tuple[str, ...],
    columns: dict[str, tuple[str, str]],
) -> Result:
    """Return what is shown with a few measurements and the fit to them, side by side;
    more than `LARGEST_SHOWN` are left out. places: variables before them."""
    if result[places[0]].values.size > LARGEST_SHOWN:
        return shown
    rows = [result[name] for name in places]
    for column, (name, component) in columns.items():
        one = result.only(name).at(component=component)[name]
        rows.append(replace(one, name=column))
    return shown.with_variables(*rows)


def undetermined_words(result: Result) -> list[str]:
    """Return which coefficients the data leave undetermined; [] if none."""
    missing = result["parameter"].values[result["undetermined"].values > 0]
    if not missing.size:
        return []
    return [f"not determined by these drags: {', '.join(missing)}"]


def rod_words(result: Result) -> list[str]:
    """Return the rod's ends and sizes, and the sizes that are missing."""
    ends = float(result["end_caps"])
    caps = "left out"
    if ends:
        caps = f"{ends:.3g} flat ends"
    sizes = []
    for name in SIZES:
        if f"rod_{name}" in result:
            size = result[f"rod_{name}"]
            sizes.append(f"{name} {float(size):g} {size.unit}")
    of_rod = ", ".join(sizes) or "sizes unknown"
    lines = [f"end caps: {caps}; rod and bed: {of_rod}"]
    lacks = result.attributes.get("lacks", "")
    if lacks:
        first = lacks.partition(",")[0]
        lines.append(
            f"k is unknown without {lacks}: add it to the header lines, or as --{first}"
        )
    return lines
