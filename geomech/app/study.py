"""The study of a scene: what is computed of it, as numbers, tables and pictures."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, TypeGuard

import numpy as np

from geomech import plots
from geomech.app.questions import optimise, sweep
from geomech.app.results import Displacements, Forces, Optimum, Swept
from geomech.core.errors import choose
from geomech.gaits import Gait
from geomech.geometry.field import Field
from geomech.geometry.plane import Plane, ProjectedGait
from geomech.io.results import to_xarray
from geomech.output import animate, display
from geomech.scenes.parts import as_scene
from geomech.studies import fields, forces
from geomech.studies import study as studies
from geomech.studies.choose import cheapest
from geomech.studies.motion import Trajectory
from geomech.studies.newtons import Sizes
from geomech.studies.report import reachable
from geomech.systems.base import shape_labels
from rft.checks import is_number, is_whole
from rft.refusal import Refusal, located

COMPONENTS = {"x": 0, "y": 1, "theta": 2, "heading": 2}


class Study(studies.Study):
    """A scene and all that is computed of it; each table is computed once.

    Parameters
    ----------
    *parts :
        The name of a built-in scene, a TOML file, a Scene, or its parts: a medium and a body, or a system, or a
        function velocity(alpha, alphadot) -> xi (..., 3), and a gait.
    effects : list of effects
        Those of a medium and a body.
    **numerics :
        Other settings than the scene's, such as grid=21, phases=64; and joints=4, of a
        velocity that comes without a gait.

    Examples
    --------
    >>> import geomech
    >>> study = geomech.study("three-link-glass", phases=64)
    >>> table = study.displacement([0.5, 1.0], ["direct"])
    >>> [round(x, 4) for x in table["net_distance"]["direct"]]
    [0.0121, 0.0638]
    """

    def __init__(self, *parts: Any, effects: Sequence = (), **numerics: Any):
        super().__init__(as_scene(*parts, effects=effects, **numerics))

    def _repr_html_(self) -> str:
        return display.study(self)

    def to_xarray(self) -> Any:
        """Return a Dataset with all that the file of `geomech connection` has. ImportError without the package xarray."""
        return to_xarray(fields.of_study(self))

    def displacement(
        self, amplitudes: float | Sequence[float] | None = None, tiers: str | Sequence[str] | None = None, *,
        gait: Gait | None = None, tolerance: float | None = None,
    ) -> Displacements:  # fmt: skip
        """Return the net displacement per cycle, with errors, as a table that prints and plots itself.

        Parameters
        ----------
        amplitudes : number or list
            Of the gait, rad unless the gait says otherwise; by default its own.
        tiers : name or list of names
            Methods of prediction, of `tiers`; by default all that serve every gait.
        gait : Gait
            By default the scene's.
        tolerance : number
            In place of tiers: the cheapest tier whose errors of position are at most so many body lengths.

        Examples
        --------
        >>> import geomech
        >>> study = geomech.study("three-link-viscous", grid=15)
        >>> table = study.displacement([0.5, 1.0], ["path", "direct"])
        >>> [round(x, 4) for x in table["direct"][1][:2]]  # x, y in body lengths, at 1 rad
        [-0.0495, 0.0134]
        >>> [round(x, 4) for x in table["net_distance"]["path"]]
        [0.0153, 0.0513]
        """
        chosen = self.scene.gait if gait is None else gait
        amplitudes = (
            getattr(chosen, "amplitude", 1.0) if amplitudes is None else amplitudes
        )
        values: Any = [amplitudes] if is_number(amplitudes) else amplitudes
        if tolerance is None:
            return self.study(
                values, [tiers] if isinstance(tiers, str) else tiers, gait
            )
        if tiers is not None:
            raise Refusal("tolerance chooses the tier", instead="drop tiers")
        return Displacements(cheapest(self.scene, values, tolerance, gait).result)

    def study(
        self,
        amplitudes: Sequence[float],
        tiers: Sequence[str] | None = None,
        gait: Gait | None = None,
        progress: Callable | None = None,
    ) -> Displacements:
        return Displacements(super().study(amplitudes, tiers, gait, progress).result)

    def ccf(
        self, pair: Sequence[int] | None = None, at: Sequence[float] | None = None
    ) -> Field:
        """Return the CCF, values (3, N, N) on a grid of two shape variables.

        pair: two joints, the first is 1; needed where there are more than two. at: (joints,), rad, a shape where the
        others are held; by default the gait's middle.

        Examples
        --------
        >>> import geomech
        >>> study = geomech.study("three-link-viscous", grid=15)
        >>> study.ccf().values.shape  # x, y and theta on a grid of both joints
        (3, 15, 15)
        >>> round(float(study.ccf()([0.0, 0.0])[0]), 3)  # body lengths per rad^2
        -0.021
        """
        return self._plane(pair, at).ccf if self._is_slice(pair) else self.curvature

    def ccf_error(
        self, pair: Sequence[int] | None = None, at: Sequence[float] | None = None
    ) -> Field:
        """Return the estimated error of `ccf`.

        Examples
        --------
        >>> import geomech
        >>> study = geomech.study("three-link-viscous", grid=15)
        >>> round(float(study.ccf_error()([0.0, 0.0])[2]), 5)  # of theta, rad per rad^2
        0.00137
        """
        return (
            self._plane(pair, at).error
            if self._is_slice(pair)
            else self.curvature_error
        )

    def plot_ccf(
        self, component: int | str = "x", pair: Sequence[int] | None = None, at: Sequence[float] | None = None, *,
        ax: Any = None, **options: Any,
    ) -> Any:  # fmt: skip
        """Draw a component of the CCF, x, y or theta, with the gait on it; hatched where its error exceeds it.

        pair, at: as of `ccf`. options: of `geomech.plots.ccf_map`. Return the Axes.

        Examples
        --------
        >>> import geomech
        >>> study = geomech.study("three-link-viscous", grid=15)
        >>> ax = study.plot_ccf("theta")
        """
        gait, labels = self._drawn(pair, at)
        options = {
            "gaits": [gait],
            "labels": labels,
            "error": self.ccf_error(pair, at),
            **options,
        }
        return plots.ccf_map(
            self.ccf(pair, at), _component(component), ax=ax, **options
        )

    def plot_connection(
        self, component: int | str = "x", pair: Sequence[int] | None = None, at: Sequence[float] | None = None, *,
        ax: Any = None, **options: Any,
    ) -> Any:  # fmt: skip
        """Draw a row of the local connection, x, y or theta, as arrows over shape space; return the Axes.

        pair, at: as of `ccf`. options: of `geomech.plots.vector_field`.

        Examples
        --------
        >>> import geomech
        >>> study = geomech.study("three-link-viscous", grid=15)
        >>> ax = study.plot_connection("x")
        """
        A = self._plane(pair, at).connection if self._is_slice(pair) else self.fitted
        options = {"labels": self._drawn(pair, at)[1], **options}
        return plots.vector_field(A, _component(component), ax=ax, **options)

    def plot_displacement(
        self, amplitudes: float | Sequence[float] | None = None, tiers: str | Sequence[str] | None = None,
        quantity: str = "net_distance", *, gait: Gait | None = None, ax: Any = None, **options: Any,
    ) -> Any:  # fmt: skip
        """Draw x, y, heading or net_distance per cycle against amplitude, a line a tier; return the Axes.

        amplitudes: by default some ten, up to the largest that the tables reach.

        Examples
        --------
        >>> import geomech
        >>> study = geomech.study("three-link-viscous", grid=15)
        >>> ax = study.plot_displacement([0.5, 1.0], ["path", "direct"])
        """
        chosen = self.scene.gait if gait is None else gait
        amplitudes = reachable(self.scene, chosen) if amplitudes is None else amplitudes
        return self.displacement(amplitudes, tiers, gait=gait).plot(
            quantity, ax=ax, **options
        )

    def animate(self, path: str | Path = "swim.gif", *, cycles: int = 1) -> Path:
        """Write a film of the body beside its gait on the CCF, .gif or .mp4, or a strip of it, .png, .pdf or .svg;
        return its path.

        Examples
        --------
        >>> import pathlib, tempfile
        >>> import geomech
        >>> study = geomech.study("three-link-viscous", grid=15, phases=16)
        >>> study.animate(pathlib.Path(tempfile.mkdtemp()) / "swim.png").name
        'swim.png'
        """
        animate.check_format(path := Path(path))
        animate.write(Trajectory(self.scene, cycles, drawn=True).ask(), path)
        return path

    def forces(self, **sizes: float) -> Forces:
        """Return force, power and bending moment along the body over a cycle of the gait, and when its muscles work.

        sizes: length, radius and depth of the body, m, or its axial stress, Pa, and the frequency, Hz, where the scene does
        not have them; with these forces are in N and powers in W, else in axial drags of the straight body.

        Examples
        --------
        >>> import geomech
        >>> forces = geomech.study("seven-link-wave", phases=32).forces()
        >>> forces["forward"].shape
        (32, 42)
        """
        return Forces(forces.Forces(self.scene, Sizes(**sizes)).ask())

    def optimise(self, objective: str = "displacement", **options: Any) -> Optimum:
        """Return the best gait for an objective; see `geomech.optimise`.

        Examples
        --------
        >>> import geomech
        >>> best = geomech.study("three-link-viscous", grid=15).optimise(harmonics=1, starts=1)
        >>> round(best.value, 3)  # body lengths per cycle
        0.101
        """
        return optimise(self.scene, objective, **options)

    optimize = optimise

    def sweep(self, over: Mapping[str, Sequence[float]]) -> Swept:
        """Return displacements over a grid of parameters such as {"medium.C": [1, 2, 3]}; see `geomech.sweep`.

        Examples
        --------
        >>> import geomech
        >>> study = geomech.study("three-link-viscous", grid=15)
        >>> study.sweep({"medium.ratio": [1.5, 2.0]})["displacement"].round(3)  # x, y, theta at each point
        array([[-0.026,  0.007,  0.   ],
               [-0.049,  0.013,  0.   ]])
        """
        return sweep(self.scene, over)

    def _is_slice(self, pair: Sequence[int] | None) -> TypeGuard[Sequence[int]]:
        """Return whether a map is a slice of more than two joints; Refusal where nobody says which."""
        joints = self.scene.system.joints
        if pair is None and joints > 2:
            raise Refusal(
                f"a body of {joints} joints has no one map",
                where=self.scene.name,
                instead="give pair=(1, 2) or another",
            )
        return pair is not None

    def _plane(self, pair: Sequence[int], at: Sequence[float] | None) -> Plane:
        with located(self.scene.name):
            if np.ndim(pair) != 1 or not all(map(is_whole, pair)):
                raise Refusal("pair must be two joints such as (1, 2)", value=pair)
        return self.plane([int(k) - 1 for k in pair], at)

    def _drawn(
        self, pair: Sequence[int] | None, at: Sequence[float] | None
    ) -> tuple[Any, list]:
        """Return the gait as a map shows it, and the labels of its axes."""
        labels, gait = list(shape_labels(self.scene.system)), self.scene.gait
        if not self._is_slice(pair):
            return gait, labels
        plane = self._plane(pair, at)
        return ProjectedGait(gait, plane), [labels[k] for k in plane.pair]


def study(*parts: Any, effects: Sequence = (), **numerics: Any) -> Study:
    """Return the study of a scene: `study("three-link-glass")`, of a TOML file, a Scene, or its parts: `study(medium,
    body, gait)`, `study(system, gait)`, `study(velocity, gait)`. See `Study`.

    Examples
    --------
    >>> import geomech
    >>> from geomech import bodies, gaits, media
    >>> study = geomech.study(media.Viscous(), bodies.Chain(), gaits.Circle(0.5))
    >>> table = study.displacement(tiers="direct")
    >>> [round(x, 5) for x in table["net_distance"]["direct"]]
    [0.0153]
    """
    return Study(*parts, effects=effects, **numerics)


def _component(component: int | str) -> int:
    if isinstance(component, str):
        return COMPONENTS[choose("component", component, COMPONENTS)]
    if not (is_whole(component) and 0 <= component < 3):
        raise Refusal("component must be x, y or theta", value=component)
    return int(component)
