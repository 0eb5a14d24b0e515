"""Results as files of figures: functions of (result, path)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from geomech import plots
from geomech.core.errors import choose
from geomech.core.variables import Result
from geomech.studies import tables
from geomech.studies.effort import units
from geomech.studies.shape_space import Space
from geomech.systems.base import shape_labels
from rft.refusal import Refusal

check = plots.check_format
CALIBRATIONS = {
    "rod_drag": plots.drag_figure,
    "plate_drags": plots.plates_figure,
    "penetration": plots.penetration_figure,
}


def displacement(result: Result, path: Path, **options: Any) -> None:
    """Draw net displacements against amplitude. options: of `plots.displacement_figure`."""
    scene, gait = result.subject
    table = {type(gait).__name__.lower(): tables.table(result)}
    plots.save(
        plots.displacement_figure(table, [gait], system=scene.system, **options), path
    )


def sweep(result: Result, path: Path) -> None:
    """Draw a sweep over one parameter or two."""
    from geomech.studies.sweep import Swept

    plots.save(plots.sweep_figure(result.subject, Swept(result)), path)


def intrusion(result: Result, path: Path) -> None:
    """Draw forces along a motion."""
    plots.save(plots.intrusion_figure(*result.subject), path)


def stress(result: Result, path: Path) -> None:
    """Draw a stress map."""
    plots.save(plots.stress_figure(*result.subject), path)


def measured(result: Result, path: Path) -> None:
    """Draw a measured gait, or midlines."""
    figure = (
        plots.midlines_figure(result)
        if result.kind == "midlines"
        else plots.measured_figure(result.subject)
    )
    plots.save(figure, path)


def forces(result: Result, path: Path, **options: Any) -> None:
    """Draw forces along a body. options: of `plots.forces_figure`."""
    plots.save(plots.forces_figure(result, **options), path)


def calibration(result: Result, path: Path) -> None:
    """Draw measurements and the law that was fitted to them."""
    plots.save(CALIBRATIONS[result.kind](result), path)


@dataclass(frozen=True)
class Optimum:
    """A drawing of the best gait. stretch: where equal lengths take equal effort, too. clim: limit of the colours."""

    stretch: bool
    plot: Path | None
    clim: float | str | None = None

    def __post_init__(self) -> None:
        if self.stretch and self.plot is None:
            raise Refusal("--stretch is a way to draw", instead="say --plot FILE, too")

    def __call__(self, result: Result, path: Path) -> None:
        plots.save(
            plots.optimum_figure(result.subject, self.stretch, clim=self.clim), path
        )


@dataclass(frozen=True)
class Connection:
    """A drawing of a connection as arrows or streamlines. components: panels, all that are not zero if there are none. clim:
    limit of the colours."""

    style: str | None
    plot: Path | None
    pair: str | None
    slice_: str | None
    other_frame: str | None
    components: Sequence[str] = ()
    clim: float | str | None = None

    def __post_init__(self) -> None:
        options = (
            self.style,
            self.pair,
            self.slice_,
            self.other_frame,
            self.components or None,
            self.clim,
        )
        if self.plot is None and any(option is not None for option in options):
            raise Refusal(
                "--style, --component, --pair, --slice, --compare-frame and --clim are those of a figure",
                instead="say --plot FILE",
            )
        if self.style is not None:
            choose("--style", self.style, plots.CONNECTION_STYLES)

    def __call__(self, result: Result, path: Path) -> None:
        space: Space = result.subject
        scene = space.study.scene
        options: dict[str, Any] = {
            "labels": shape_labels(scene.system),
            "style": self.style or "quiver",
        }
        options |= {"components": self.components, "clim": self.clim}
        if space.planes:
            plots.save(plots.plane_connection_figure(space.planes, **options), path)
            return
        if space.other:
            options |= {
                "beside": space.other.fitted,
                "names": [scene.frame, self.other_frame],
            }
        plots.save(plots.connection_figure(space.study.fitted, **options), path)


@dataclass(frozen=True)
class Ccf:
    """A drawing of a CCF with the scene's gait on it, or of slices of it. components: panels, all that are not zero if none
    is named. clim: limit of the colours."""

    style: str | None
    metric: bool
    stretch: bool
    other_frame: str | None
    components: Sequence[str] = ()
    clim: float | str | None = None

    def __post_init__(self) -> None:
        if self.style is not None:
            choose("--style", self.style, plots.CCF_STYLES)
        if self.stretch and (
            self.metric or self.other_frame or self.style not in (None, "map")
        ):
            raise Refusal(
                "--stretch is a map of its own",
                instead="drop --style, --metric and --compare-frame",
            )
        if self.metric and self.style not in (None, "map"):
            raise Refusal(
                "--metric draws on a map", instead=f"drop --style {self.style}"
            )

    def __call__(self, result: Result, path: Path) -> None:
        space: Space = result.subject
        plots.save(self._slices(space) if space.planes else self._map(space), path)

    @property
    def _panels(self) -> dict[str, Any]:
        return {"components": self.components, "clim": self.clim}

    def _slices(self, space: Space) -> Any:
        scene, options = (
            space.study.scene,
            {"style": self.style or "map", **self._panels},
        )
        if space.other_planes:
            options |= {
                "beside": space.other_planes[0],
                "names": [scene.frame, self.other_frame],
            }
        return plots.planes_figure(
            space.planes, scene.gait, labels=shape_labels(scene.system), **options
        )

    def _map(self, space: Space) -> Any:
        study, scene, other = space.study, space.study.scene, space.other
        options: dict[str, Any] = {
            "gaits": [scene.gait],
            "error": study.curvature_error,
            "labels": shape_labels(scene.system),
        }
        if self.stretch:
            options["unit"] = units(scene.system)["path_length"]
            return plots.stretched_figure(
                study.curvature, space.stretch, **options, **self._panels
            )
        options |= {
            "style": self.style or "map",
            "metric": study.metric if self.metric else None,
            **self._panels,
        }
        if other:
            options |= {
                "beside": (other.curvature, other.curvature_error),
                "names": [scene.frame, self.other_frame],
            }
        return plots.ccf_figure(study.curvature, **options)
