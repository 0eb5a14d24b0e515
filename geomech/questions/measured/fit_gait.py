"""A measured gait: a log of joint angles gives the connection near its mean gait,
tracked midlines the kinematics of a trial, beside those that a medium predicts."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING, Annotated, Any, ClassVar

from geomech.core.variables import Result
from geomech.io.files import write_text
from geomech.questions.measured import logs, trials
from geomech.questions.shared import loading, parsing, tools
from geomech.questions.shared.base import Option, Question, Run, Subject
from rft.core.checks import in_range
from rft.core.refusal import Refusal

if TYPE_CHECKING:
    from geomech.studies.measured.log import Log
    from geomech.studies.measured.midlines.trial import Trial

HELP = "table of joint angles, x, y, heading, or of midline points"
SCENE = ".toml"
PANELS = "panels of midlines: track,slip_along,amplitude_along,speed,heading,slip"


def write_scene(path: Path, result: Result, *, field: Path | None = None) -> None:
    """Write a scene of the mean gait of a log, which takes the connection from a file
    of the result. field: that file; by default the one that the command writes, or of
    the scene's name with the ending .nc."""
    from geomech.results.measured import scene_text

    written = getattr(result.question, "connection_file", None)
    if field is None:
        field = written or path.with_suffix(".nc")
    if field != written and not field.exists():
        raise Refusal(
            f"there is no file {field}",
            because="a scene of a mean gait reads its connection from a file",
            instead=f"write that file first, for example with save({str(field)!r})",
        )
    write_text(path, scene_text(result, field, path))


NO_SIZE = {  # cures where a measurement has no absolute size, by its form
    "log": "name the columns x_m and y_m and give ``body_length``, or give unit BL",
    "midlines": "give the mm per pixel as ``scale`` or the unit as ``units``, or unit "
    "BL",
}


@dataclass(frozen=True)
class FitGait(Question):
    """Fit a measured gait. A log of joint angles gives the connection near its mean
    gait. Tracked midlines give speed, heading, slip, wave efficiency, amplitude and
    wavelength, and --medium adds their prediction. All values have confidence
    intervals. -o FIELD.nc -o SCENE.toml writes the connection and a scene of the mean
    gait."""

    file: Annotated[
        "str | Path | Log | Trial",
        Subject(loading.as_typed, None, (), "FILE.csv", HELP),
    ]
    columns: Annotated[
        Sequence[str],
        Option(
            "columns T,A1,A2,...,X,Y,HEADING, or midline points",
            "LIST",
            parsing.names,
        ),
    ] = ()
    degrees: Annotated[bool, Option("joint angles and heading are in degrees")] = False
    level: Annotated[
        float,
        Option("confidence level of intervals (default 0.95)", "SHARE"),
    ] = 0.95
    harmonics: Annotated[
        int | None,
        Option("harmonics of A in phase (default cross-validated)", "N"),
    ] = None
    limits: Annotated[
        float | None,
        Option(
            "largest distance of the field from the mean gait", "ANGLE", parsing.angle
        ),
    ] = None
    body_length: Annotated[
        float | None, Option("length of the body, in the unit of x and y", "M")
    ] = None
    medium: Annotated[
        Any, Option("medium or its file, to predict the midlines", "NAME")
    ] = None
    units: Annotated[
        str | None,
        Option("unit of x and y of midlines: m, cm, mm, px or BL", "UNIT"),
    ] = None
    scale: Annotated[float | None, Option("mm per pixel of the film", "MM")] = None
    fps: Annotated[float | None, Option("frames per second of the film", "N")] = None
    y: Annotated[
        str | None, Option("direction of y in the file: up or down", "SENSE")
    ] = None
    head: Annotated[
        str | None,
        Option("head is the first or last point (default by motion)", "END"),
    ] = None
    least_score: Annotated[
        float | None,
        Option("lowest score of points used (default 0.6 for likelihoods)", "P"),
    ] = None
    individual: Annotated[
        str | None, Option("animal to use, if the file has several", "NAME")
    ] = None
    mend: Annotated[
        bool,
        Option("leave out points that jump or swap, reverse turned frames"),
    ] = False
    # Effects on the body in the medium, which have no text on the command line.
    effects: Sequence[Any] = field(default=(), kw_only=True)
    # Whether A is computed on a grid, for files; the file that a scene takes it from.
    mapped: bool = field(default=True, kw_only=True)
    connection_file: Path | None = field(default=None, kw_only=True)

    name: ClassVar[str] = "fit_gait"
    looks: ClassVar[tuple[str, ...]] = (*Question.looks, "unit")
    table: ClassVar[tuple[str, ...]] = ("cycle",)

    def __post_init__(self) -> None:
        columns = tools.as_words("columns", self.columns)
        self._set(columns=columns, effects=tuple(self.effects))

    @property
    def path(self) -> Path | None:
        """The measured file; None for values from Python."""
        if isinstance(self.file, str | Path):
            return Path(self.file)
        return None

    def inputs(self) -> list[Path]:
        found = []
        if self.path is not None:
            found.append(self.path)
        if isinstance(self.medium, str | Path) and Path(self.medium).is_file():
            found.append(Path(self.medium))
        return found

    def for_files(self, paths: list[Path], options: dict[str, Any]) -> Question:
        scenes = [path for path in paths if path.suffix.lower() == SCENE]
        fields = [path for path in paths if path.suffix.lower() == ".nc"]
        if scenes and len(fields) != 1:
            raise Refusal(
                f"{scenes[0]} reads the connection from one file",
                instead="add -o FIELD.nc",
            )
        connection_file = None
        if scenes:
            connection_file = fields[0]
        return replace(self, mapped=bool(paths), connection_file=connection_file)

    @cached_property
    def form(self) -> str:
        """What was measured: "log" or "midlines"."""
        from geomech.studies.measured import ask

        names = {*ask.OF_LOGS, *ask.OF_MIDLINES} - {"scene"}
        given = {name: getattr(self, name) for name in names}
        return ask.form_of(
            self.path or self.file, {**given, "scene": self.connection_file}
        )

    def check(self) -> None:
        if self.body_length is not None:
            in_range("``body_length``", self.body_length, 1e-9, 1e9)
        _ = self.form  # refuses options of the other
        _ = self.loaded_medium

    @cached_property
    def loaded_medium(self) -> Any:
        """The medium of a prediction; None without one."""
        from geomech.scenes.read import medium_of

        if isinstance(self.medium, str | Path):
            return medium_of(self.medium)
        return self.medium

    def compute(self, run: Run) -> Result:
        if self.form == "log":
            return self._of_log()
        return self._of_midlines()

    @cached_property
    def measurements(self) -> Any:
        """The log or the trial of the file; values from Python as they are."""
        if self.path is None:
            return self.file
        if self.form == "log":
            from geomech.studies.measured.log import read as read_log

            return read_log(self.path, self.columns, self.degrees)
        from geomech.studies.measured.midlines.reader import read

        names = (
            "units", "scale", "fps", "y", "least_score", "body_length", "individual",
        )  # fmt: skip
        given = {name: getattr(self, name) for name in names}
        return read(self.path, points=self.columns, **given)

    def check_unit(self, unit: str) -> None:
        from geomech.core.errors import choose
        from geomech.results.length_units import UNITS

        choose("``unit``", unit, UNITS)
        found = self.measurements
        in_metres = getattr(found, "unit", "") == "m"
        if self.form == "log":
            has_length = self.body_length is not None
            in_metres = has_length and getattr(found, "metres", False)
        if in_metres or unit == "BL":
            return
        raise Refusal(
            f"lengths of {found.name} are in body lengths only",
            where="``unit``",
            value=unit,
            instead=NO_SIZE[self.form],
        )

    def _of_log(self) -> Result:
        from geomech.studies.measured.fit import fit_log
        from geomech.studies.measured.results import fit_result

        names = ("columns", "degrees", "level", "harmonics", "limits", "body_length")
        given = {name: getattr(self, name) for name in names}
        return fit_result(fit_log(self.measurements, **given), self.mapped)

    def _of_midlines(self) -> Result:
        from geomech.studies.measured.midlines.fit import fit_midlines
        from geomech.studies.measured.midlines.predicted import compare
        from geomech.studies.measured.midlines.results import trial_result

        fit = fit_midlines(
            self.measurements, head=self.head, mend=self.mend, level=self.level
        )
        if self.loaded_medium is None:
            return trial_result(fit)
        return trial_result(fit, compare(fit, self.loaded_medium, tuple(self.effects)))

    def answer(self, run: Run) -> Result:
        # Measurements have a name, and are no scene.
        return replace(self.compute(run), question=self)

    def ask(self, tables: Any = None) -> Result:
        result = super().ask(tables)
        tools.warn_of_notes(result)
        return result

    @staticmethod
    def files() -> dict[str, Any]:
        return {SCENE: write_scene}

    @staticmethod
    def headline(result: Result) -> list[str]:
        return presenting(result).headline(result)

    @staticmethod
    def summary(result: Result) -> Result:
        return presenting(result).summary(result)

    @staticmethod
    def remarks(result: Result) -> list[str]:
        return presenting(result).remarks(result)

    @staticmethod
    def lengths(result: Result) -> Any:
        from geomech.results.length_units import Lengths

        if result.attributes["form"] == "log":
            if result.attributes["length_unit"] != "m":
                return Lengths({"BL": None})
            return Lengths({"m": 1.0}, float(result.attributes["body_length"]))
        body = result["body_length"]
        if body.unit != "m":
            return Lengths({"BL": None})
        return Lengths({"BL": float(body), "m": 1.0}, float(body))

    def check_draw(self, component: Sequence[str] = ()) -> None:
        if component and self.form == "log":
            raise Refusal(
                "``component`` chooses panels of midlines",
                instead="leave it out for a log of joint angles",
            )

    @staticmethod
    def draw(
        result: Result,
        *,
        component: Annotated[
            Sequence[str], Option(PANELS, "NAMES", parsing.midline_panels)
        ] = (),
    ) -> Any:
        """Draw the mean gait, the connection along it and its cycles; or the way of the
        body, slip and amplitude along it, and the prediction. Return the Figure."""
        from geomech import plots

        if result.attributes["form"] == "log":
            return plots.measured_figure(result)
        if isinstance(component, str):
            component = (component,)
        return plots.midlines_figure(result, component)


def presenting(result: Result) -> ModuleType:
    """Return the module with the words for what was measured."""
    if result.attributes["form"] == "log":
        return logs
    return trials
