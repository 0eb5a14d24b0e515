"""What ``import geomech`` offers besides the parts: the study of a scene, whose methods
ask questions."""

from __future__ import annotations

import difflib
import inspect
from collections.abc import Callable, Sequence
from functools import cached_property
from pathlib import Path
from typing import Any, Concatenate, ParamSpec

from geomech.core.variables import Result
from geomech.questions.grains.drag_grains import DragGrains
from geomech.questions.grains.grains import Grains
from geomech.questions.measured.fit_gait import FitGait
from geomech.questions.measured.fit_medium import FitMedium
from geomech.questions.shared.base import Question, options, plain_type, subject_field
from geomech.questions.shared.loading import REQUIRED
from geomech.questions.shared.tools import is_film
from geomech.questions.swimmers.accuracy import Accuracy
from geomech.questions.swimmers.ccf import Ccf
from geomech.questions.swimmers.connection import Connection
from geomech.questions.swimmers.displacement import Displacement
from geomech.questions.swimmers.forces import Forces
from geomech.questions.swimmers.optimize import Optimize
from geomech.questions.swimmers.run import Run
from geomech.questions.swimmers.sweep import Sweep
from geomech.questions.swimmers.trajectory import Trajectory
from geomech.questions.swimmers.velocity import Velocity
from geomech.questions.terradynamics.intrude import Intrude
from geomech.questions.terradynamics.stress import Stress
from geomech.questions.terradynamics.walk import Walk
from geomech.scenes.parts import as_scene
from geomech.studies.scene_tables import SceneTables
from rft.core.refusal import Refusal

Fields = ParamSpec("Fields")


def method(
    question: Callable[Concatenate[Any, Fields], Question],
) -> Callable[Concatenate[Study, Fields], Result]:
    """Return the method of `Study` that asks a question of its scene.

    Its parameters are the fields of the question; unknown ones are refused."""

    def ask(self: Study, *values: Fields.args, **options: Fields.kwargs) -> Result:
        refuse_unknown(question, options)
        refuse_kind(question, self.scene)
        return question(self.scene, *values, **options).ask(self._tables)

    describe(ask, question, "self")
    return ask


def function_of_scene(
    question: Callable[Concatenate[Any, Fields], Question],
) -> Callable[Concatenate[Any, Fields], Result]:
    """Return the function that asks a question of a scene, in any form that `study`
    takes."""

    def ask(scene: Any, *values: Fields.args, **options: Fields.kwargs) -> Result:
        refuse_unknown(question, options)
        scene = as_scene(scene)
        refuse_kind(question, scene)
        return question(scene, *values, **options).ask()

    describe(ask, question, "scene")
    return ask


def function_of(
    subject: str, question: Callable[Concatenate[Any, Fields], Question]
) -> Callable[Concatenate[Any, Fields], Result]:
    """Return the function that asks a question of what is no scene: a file of
    measurements, or a medium by its name or file.

    subject: name of the function's first parameter."""

    def ask(about: Any, *values: Fields.args, **options: Fields.kwargs) -> Result:
        refuse_unknown(question, options)
        return question(about, *values, **options).ask()

    describe(ask, question, subject)
    return ask


def function_of_options(
    question: Callable[Fields, Question],
) -> Callable[Fields, Result]:
    """Return the function that asks a question that has options alone."""

    def ask(*values: Fields.args, **options: Fields.kwargs) -> Result:
        refuse_unknown(question, options)
        return question(*values, **options).ask()

    describe(ask, question, "")
    return ask


def describe(ask: Any, question: Any, subject: str) -> None:
    """Give a function the name, the documentation and the parameters of a question.

    subject: name of the parameter that the question is about; "" without one."""
    fields = list(inspect.signature(question).parameters.values())
    parameters = []
    if subject:
        kind = inspect.Parameter.POSITIONAL_OR_KEYWORD
        parameters.append(inspect.Parameter(subject, kind, annotation=Any))
        del fields[0]
    for field in fields:
        annotation = field.annotation
        if hasattr(annotation, "__metadata__"):
            annotation = plain_type(annotation)
        parameters.append(field.replace(annotation=annotation))
    ask.__signature__ = inspect.Signature(parameters, return_annotation=Result)
    ask.__name__ = question.name
    ask.__qualname__ = question.name
    ask.__doc__ = documentation(question)


def documentation(question: Any) -> str:
    """Return what a question computes, and what its fields mean."""
    lines = [inspect.cleandoc(question.__doc__), "", "Parameters", "----------"]
    for name, (option, _, _) in options(question).items():
        lines += [name, f"    {option.help}"]
    return "\n".join(lines)


def option_names(question: Any) -> list[str]:
    """Return the names of a question's options."""
    subject, _ = subject_field(question)
    names = inspect.signature(question).parameters
    return [name for name in names if name != subject]


def refuse_kind(question: Any, scene: Any) -> None:
    """Refuse a scene of a kind that a question is not about."""
    _, subject = subject_field(question)
    if subject is not None and subject.load in REQUIRED:
        REQUIRED[subject.load](scene)


def refuse_unknown(question: Any, given: dict[str, Any]) -> None:
    """Refuse keywords that are no fields of a question, with the nearest that is."""
    names = option_names(question)
    for name in given:
        if name in names:
            continue
        instead = f"its options are {', '.join(names)}"
        nearest = difflib.get_close_matches(name, names, 1)
        if nearest:
            instead = f"did you mean {nearest[0]!r}?"
        raise Refusal(f"{question.name} has no {name!r}", instead=instead)


class Study:
    """A scene and all that is computed of it; each table is computed once.

    Its methods ask questions. Their results print themselves, and have `.plot()`,
    `.save(path)`, `.to_xarray()` and `.to_dataframe()`.

    Parameters
    ----------
    *parts :
        The name of a built-in scene, a TOML file, a Scene, or its parts: a medium and a
        body, or a system, or a function velocity(alpha, alphadot) -> xi (..., 3), and a
        gait.
    effects : list of effects
        Additions to the law, of a medium and a body.
    **numerics :
        Settings in place of the scene's, such as grid=21, phases=64.

    Examples
    --------
    >>> import geomech
    >>> study = geomech.study("three-link-glass", phases=64)
    >>> table = study.displacement([0.5, 1.0], "direct")
    >>> table.at(tier="direct")["net_distance"].values.round(4)
    array([0.0121, 0.0638])
    """

    def __init__(self, *parts: Any, effects: Sequence = (), **numerics: Any):
        self.scene = as_scene(*parts, effects=effects, **numerics)

    def __repr__(self) -> str:
        if self._tables is None:
            return f"Study({self.scene!r})"
        return repr(self.tables)

    def _repr_html_(self) -> str:
        from geomech.shell import notebook

        return notebook.study(self.tables)

    @cached_property
    def _tables(self) -> SceneTables | None:
        """The tables of a scene with a gait in shape space; None of another."""
        if not hasattr(self.scene, "system"):
            return None
        return SceneTables(self.scene)

    @property
    def tables(self) -> SceneTables:
        """What is computed of the scene: connection, CCF, metric, poses by tier."""
        if self._tables is None:
            raise Refusal(
                "this scene has no shape space",
                where=self.scene.name,
                instead="give a scene whose body swims, with a [gait]",
            )
        return self._tables

    displacement = method(Displacement)
    ccf = method(Ccf)
    connection = method(Connection)
    velocity = method(Velocity)
    sweep = method(Sweep)
    run = method(Run)
    forces = method(Forces)
    optimise = optimize = method(Optimize)
    trajectory = method(Trajectory)
    walk = method(Walk)
    intrude = method(Intrude)
    grains = method(Grains)
    accuracy = method(Accuracy)

    def animate(self, path: str | Path = "swim.gif", *, cycles: int = 1) -> Path:
        """Write a film of the body beside its gait on the CCF, .gif or .mp4, or a strip
        of it, .png, .pdf or .svg; return its path.

        Examples
        --------
        >>> import pathlib, tempfile
        >>> import geomech
        >>> study = geomech.study("three-link-viscous", grid=15, phases=16)
        >>> study.animate(pathlib.Path(tempfile.mkdtemp()) / "swim.png").name
        'swim.png'
        """
        from geomech import plots
        from geomech.plots import films

        path = Path(path)
        if is_film(path):
            films.check_format(path)
            self.trajectory(cycles).save(path)
        else:
            plots.check_format(path)
            plots.save(self.trajectory(cycles).plot(), path)
        return path


def study(*parts: Any, effects: Sequence = (), **numerics: Any) -> Study:
    """Return the study of a scene: `study("three-link-glass")`, of a TOML file, a
    Scene, or its parts: `study(medium, body, gait)`, `study(system, gait)`,
    `study(velocity, gait)`. See `Study`.

    Examples
    --------
    >>> import geomech
    >>> from geomech import bodies, gaits, media
    >>> study = geomech.study(media.Viscous(), bodies.Chain(), gaits.Circle(0.5))
    >>> table = study.displacement(tiers="direct")
    >>> table["net_distance"].values.round(5)
    array([[0.0153]])
    """
    return Study(*parts, effects=effects, **numerics)


def load_result(path: str | Path) -> Result:
    """Return the result in a file: of .nc, .json and .mat as it was saved, of .csv the
    columns. Files of former versions have the names of today.

    Examples
    --------
    >>> import pathlib, tempfile
    >>> import geomech
    >>> path = pathlib.Path(tempfile.mkdtemp()) / "moved.nc"
    >>> study = geomech.study("three-link-viscous", grid=15)
    >>> study.displacement([0.5, 1.0], "direct").save(path)
    >>> geomech.load_result(path)["x"].values.round(4)
    array([[-0.0152, -0.0495]])
    """
    from geomech.results.files import load

    return load(path)


# Of a scene, each a method of `Study` as well.
displacement = function_of_scene(Displacement)
ccf = function_of_scene(Ccf)
connection = function_of_scene(Connection)
velocity = function_of_scene(Velocity)
sweep = function_of_scene(Sweep)
run = function_of_scene(Run)
accuracy = function_of_scene(Accuracy)
forces = function_of_scene(Forces)
optimise = optimize = function_of_scene(Optimize)
trajectory = function_of_scene(Trajectory)
intrude = function_of_scene(Intrude)
walk = function_of_scene(Walk)
grains = function_of_scene(Grains)
# Of measurements, of a medium, and of options alone.
fit_medium = function_of("file", FitMedium)
fit_gait = function_of("file", FitGait)
stress = function_of("medium", Stress)
drag_grains = function_of_options(DragGrains)
