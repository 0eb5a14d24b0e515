"""Sand under the geoms of a MuJoCo model, by one call."""

from __future__ import annotations

import weakref
import zlib
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import mujoco
import numpy as np

from rft.core.checks import in_range
from rft.core.notes import warn
from rft.core.refusal import Refusal, formatted, located, require
from rft.mujoco import installed
from rft.mujoco.bed import Bed, Surface
from rft.mujoco.errors import Control, RunError, error_of_run
from rft.mujoco.ground.floor import (
    Exclusion,
    apply_exclusion,
    exclude_floor_contacts,
    floors,
    restore_floor_contacts,
)
from rft.mujoco.ground.footprints import FORM, Footprints, Prints
from rft.mujoco.ground.hills import FLAT, Hills, hills_of
from rft.mujoco.ground.regions import parse_zones
from rft.mujoco.ground.selection import choose_geoms, overlap_note
from rft.mujoco.media import Media, law_of, require_one_form, sample
from rft.mujoco.sinkage import sinkage
from rft.terradynamics.ground import (
    Ground,
    GroundEffect,
    Slope,
    checked_effects,
    ground_of,
)
from rft.terradynamics.meshes.forces.extruded import Extruded
from rft.terradynamics.meshes.forces.law import Spatial
from rft.terradynamics.meshes.geoms import geom_label, geom_name, mesh_of_elements
from rft.terradynamics.meshes.surfaces.mesh import Mesh
from rft.terradynamics.plates import StressMap

__all__ = ["Footprints", "Sand", "attach", "sample"]

MANY_ELEMENTS = 20_000  # whose steps of 2 ms take half a millisecond and more
ROUNDING = 1e-5  # m/s, assumed: bodies at rest on slopes creep at up to that speed
# Time of a step by NumPy over that of compiled code, measured by
# pytest -m benchmark -k without.
NUMPY_TIME_RATIO = 80


class Sand:
    """Sand that `attach` has put under a model. As a context manager it is detached at
    the end.

    geoms: names of the geoms in the sand, in the order of `forces`. element: length of
    the elements' edges, m; None for lengths by geom. rounding: m/s; an element of speed
    v bears v / sqrt(v^2 + rounding^2) of its stress. elements: number of elements.
    notes: lines about what was changed and what is inexact. media: of the simulations
    of the last batch that had its own; else None.

    Methods that read data need up-to-date positions and velocities, as after
    ``mj_forward``.
    """

    def __init__(
        self,
        model: mujoco.MjModel,
        bed: Bed,
        element: float | None,
        notes: Sequence[str],
        exclusion: Exclusion | None,
        hulls: bool = False,
    ):
        self.element = element
        self.geoms = tuple(geom_name(model, g) for g in bed.geoms.ids)
        self.rounding = bed.ground.rounding
        self.elements = len(bed.blocks.owner)
        self.notes = tuple(notes)
        self.media: Media | None = None
        self._model = weakref.ref(model)
        self._bed = bed
        self._shapes = _shape_numbers(model, bed.geoms.ids)
        self._hulls = hulls
        self._row = installed.install(model, bed)
        self._excluded_contacts = None
        if exclusion:
            self._excluded_contacts = exclusion.pairs[-1]
            apply_exclusion(model, exclusion)

    def __enter__(self) -> Sand:
        return self

    def __exit__(self, *_: object) -> None:
        self.detach()

    def __reduce__(self):
        raise Refusal(
            "a Sand cannot be pickled or copied",
            because="it belongs to a model of this process",
            instead="attach it again there",
        )

    def __repr__(self) -> str:
        state = "" if self.is_attached else ", detached"
        within = "" if self.element else ", which keeps forces within 3 %"
        return (
            f"Sand({len(self.geoms)} geoms, {self.elements} elements{within}; "
            f"rounding {self.rounding:.3g} m/s; error() returns the error of a "
            f"run{state})"
        )

    @property
    def is_attached(self) -> bool:
        """Whether steps of the model feel the sand."""
        return installed.is_installed(self._row, self._bed)

    def detach(self) -> None:
        """Take the sand away and let the geoms touch the floor again; a second call
        does nothing."""
        was_attached = self._row >= 0
        model = self._model()
        self._detach_media()
        installed.remove(self._row, self._bed)
        self._row = -1
        if was_attached and model is not None and self._excluded_contacts:
            restore_floor_contacts(model, *self._excluded_contacts)

    def forces(self, data: mujoco.MjData) -> np.ndarray:
        """Return the force of the grains on each geom, (G, 3), N, in the world."""
        wrenches, _ = self._wrenches_and_twists(data)
        return wrenches[:, :3]

    def wrench(self, data: mujoco.MjData, body: str | int) -> np.ndarray:
        """Return force, N, and moment about the body's origin, N m, of the grains on a
        body, (6,), in the world."""
        model = self._checked_model(data)
        number = body
        if isinstance(body, str):
            number = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_BODY, body)
        require(0 <= number < model.nbody, f"the model has no body {formatted(body)}")

        geoms = self._bed.geoms
        own = geoms.bodies == number
        wrenches, _ = self._wrenches_and_twists(data)
        force, moment = np.split(wrenches[own], 2, axis=1)
        arm = data.geom_xpos[geoms.ids[own]] - data.xpos[number]
        return np.concatenate([force.sum(0), (moment + np.cross(arm, force)).sum(0)])

    def power(self, data: mujoco.MjData) -> float:
        """Return the power of the grains on the geoms, W, at the velocities of the end
        of the step; negative where they dissipate."""
        wrenches, twists = self._wrenches_and_twists(data)
        return float((wrenches * twists).sum())

    def _wrenches_and_twists(
        self, data: mujoco.MjData
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return wrenches and twists of the geoms in the step that begins at data, (G,
        6) each, in the world."""
        model = self._checked_model(data)
        observed = installed.observe(self._row, model, data)
        turn, _ = self._bed.geoms.poses(data)
        both = np.stack([observed.wrenches, observed.twists]).reshape(2, -1, 2, 3)
        wrenches, twists = np.einsum("gij,kgpj->kgpi", turn, both).reshape(2, -1, 6)
        return wrenches, twists

    def error(
        self,
        data: mujoco.MjData,
        seconds: float,
        control: Control | None = None,
    ) -> RunError:
        """Return the errors, m, of the geoms' places ``seconds`` later: those of the
        time step, by a run with steps half as long, and those of the elements, by a run
        with elements half as long. The data stay as they are.

        control: function (model, data) that sets controls before each step."""
        model = self._checked_model(data)
        in_range("seconds", seconds, 0, 1e6, unit="s")
        return error_of_run(
            model, self._bed, data, seconds, control, self._hulls, self.element
        )

    @property
    def effort(self) -> installed.Effort:
        """Cost of the steps so far, and how many of them were not solved
        (`rft.mujoco.installed.Effort`)."""
        return installed.effort(self._row)

    def ground(
        self, data: mujoco.MjData | np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return the ground with its footprints, x (C,), y (R,) and heights (R, C), m,
        as if the geoms were not in it.

        data: of a simulation, or its userdata, (N,), such as a row of what
        ``bind("userdata")`` of a Batch gives."""
        prints = self._bed.prints
        require(
            prints is not None,
            "the ground has no memory",
            instead="pass ``footprints`` to attach",
        )
        userdata = getattr(data, "userdata", data)
        size = prints.userdata_size
        require(
            np.ndim(userdata) == 1 and len(userdata) >= size,
            f"data must be an MjData, or its userdata, {size} numbers or more",
        )
        x, y = prints.cell_middles
        memory = prints.memory(userdata)
        # Userdata of another grid hold nothing of this one.
        is_own = memory.head[FORM] == prints.grid[-1]
        heights = prints.surface + is_own * (memory.ground + memory.pressed)
        return x, y, heights

    def sinkage(self, data: mujoco.MjData, time: float = 1.0) -> tuple[float, float]:
        """Return two depths, m, by which the geoms sink from where they are in the
        data, straight down under the weight of their robot: until the grains bear it,
        and a ``time``, s, later, as the rounding lets them creep."""
        model = self._checked_model(data)
        in_range("time", time, 0, 1e6, unit="s")
        return sinkage(model, data, self._bed, time)

    def batch(
        self,
        nsim: int,
        nthread: int = 0,
        persistent: bool = False,
        media: Sequence[Any] | None = None,
    ) -> Any:
        """Return a ``mujoco.batch.Batch`` of simulations of the model in this sand.

        media: one for each simulation, of one form, such as `sample` draws;
        ``sand.media[i] = medium`` changes one later. With regions, one may be a list of
        the medium and those of the regions; a single medium leaves those of the
        regions."""
        model = self._model()
        require(
            model is not None and self.is_attached,
            "the sand is detached",
            instead="attach it again",
        )
        try:
            from mujoco.batch import Batch
        except ImportError:
            raise Refusal(
                f"MuJoCo {mujoco.__version__} has no Batch",
                instead="pip install 'mujoco>=4.0'",
            ) from None
        require(
            media is None or len(media) == nsim,
            f"media must be {nsim}, one for each simulation",
        )
        batch = Batch(model, nsim, nthread, persistent)
        # A Batch copies the model that it is given, and a copy has no sand.
        if media is None:
            batch.set_models(model)
            return batch
        new = Media(model, self._bed, media)
        self._detach_media()
        self.media = new
        batch.set_models(new.models)
        return batch

    def _detach_media(self) -> None:
        """Detach the media of the last batch that had its own."""
        if self.media is not None:
            self.media.detach()
            self.media = None

    def _checked_model(self, data: mujoco.MjData) -> mujoco.MjModel:
        """Return the model; Refusal for a detached sand, other models' data, and geoms
        that have changed."""
        model = self._model()
        require(
            model is not None and self._row >= 0,
            "the sand is detached",
            instead="attach it again",
        )
        require(
            self.is_attached,
            "another passive callback replaced the callback of the sand",
            instead="attach it again",
        )
        require(
            len(data.qvel) == model.nv and data.geom_xpos.shape[0] == model.ngeom,
            "the data belong to another model",
        )
        shapes = _shape_numbers(model, self._bed.geoms.ids)
        changed = np.flatnonzero((shapes != self._shapes).any(1))
        if changed.size:
            raise Refusal(
                f"the geom {formatted(self.geoms[changed[0]])} changed after attach",
                instead="detach the sand and attach it again",
            )
        return model


def attach(
    model: mujoco.MjModel,
    medium: str | StressMap | Spatial | Extruded,
    geoms: str | int | Sequence[str | int] | None = None,
    level: float | str = 0.0,
    slope: float = 0.0,
    element: float | None = None,
    rounding: float | None = None,
    effects: Sequence[GroundEffect] = (),
    regions: Mapping[str, Any] | None = None,
    footprints: Footprints | None = None,
    hulls: bool = False,
) -> Sand:
    """Put sand under geoms of a MuJoCo model, until `Sand.detach` or until the model is
    gone.

    Parameters
    ----------
    model : MjModel
        Compiled model, z up. Its MjData, ``mj_step``, ``mj_forward``, ``rollout`` and
        the viewer feel the sand; a copy of the model does not, so a ``Batch`` is made
        by `Sand.batch`.
    medium : str, StressMap or Spatial
        Name in `rft.terradynamics.plates.VERTICAL` or a stress map of the vertical
        plane, extended to three dimensions by
        `rft.terradynamics.meshes.forces.extruded`; or a law of three dimensions.
    geoms : str, int or list of these
        Names of the geoms in the sand or of their bodies, patterns such as "leg*" and
        groups; by default all that move. Geoms that can touch nothing are left out,
        unless they are named or nothing else is meant.
    level : float, m, or str
        Height of the surface at x = 0; or the name of a height field, which then is the
        surface. Each geom sees the plane that touches it below the geom; the ground
        there is as strong as level ground.
    slope : float, rad
        Angle by which the surface rises along x; the ground is weaker downhill, as in
        `rft.terradynamics.ground.Slope`, which in ``effects`` means the same and may
        have another angle of repose.
    element : float, m
        Length of the edges of the triangles that geoms are cut into; by default as many
        as the shape of each geom needs
        (`rft.terradynamics.meshes.geoms.mesh_of_elements`).
    rounding : float, m/s
        Speed below which the stress on an element falls off in proportion to its speed;
        by default 1e-5 m/s.
    effects : list of GroundEffect
        Effects on the ground, such as `rft.terradynamics.ground.GrainInertia`.
    regions : dict
        Other media by the regions where they lie, such as ``{"x > 0.5":
        "poppy-seeds-close", "0 < y < x": other}``, with x and y in m in the world. A
        place belongs to the first region that holds it, or else to ``medium``.
    footprints : Footprints
        Grid on which the ground remembers what geoms press down and heap up; None for
        ground that remembers nothing.
    hulls : bool
        Whether meshes without an inside, such as open ones, stand for their convex
        hulls, as in MuJoCo's contacts.

    Returns
    -------
    Sand
        Forces for logging and reward, and ``detach``; also a context manager.

    Raises
    ------
    Refusal
        For geoms and media that make no sense; nothing is changed then.

    Notes
    -----
    The geoms no longer touch planes that lie in the surface; a plane below it remains,
    as the bottom of a shallow bed. What is changed or inexact is a
    `rft.core.notes.Note`, a warning of one line.
    """
    require(
        isinstance(model, mujoco.MjModel), "model must be a mujoco.MjModel", value=model
    )
    require(model.nv > 0, "nothing in the model can move", because="it has no joints")
    slope, effects = _slope(model, slope, effects)
    hills, field = _height_field(model, level, slope)
    plane_level = 0.0 if field else level
    in_range("level", plane_level, -1e6, 1e6, unit="m")

    regions = {} if regions is None else regions
    zones = parse_zones(regions)
    laws = (*map(law_of, regions.values()), law_of(medium))
    require_one_form(laws)

    chosen, notes = choose_geoms(model, geoms)
    _require_free(model, chosen)
    require_passive(model)
    if element is not None:
        in_range("element", element, 1e-6, 1e3, unit="m")
    require(
        isinstance(hulls, bool | np.bool_), "hulls must be True or False", value=hulls
    )
    hulls = bool(hulls)
    ground = _ground(rounding, effects)

    own_meshes = meshes(model, chosen, element, hulls)
    surface = Surface.inclined(slope, plane_level, hills)
    bed = Bed.from_meshes(model, chosen, own_meshes, laws, zones, ground, surface)
    if footprints is not None:
        bed = with_footprints(model, bed, footprints, hulls)

    exclusion = None
    planes = field or floors(model, surface.up, surface.level)
    planes = [plane for plane in planes if _may_touch(model, chosen, plane)]
    if planes:
        exclusion = exclude_floor_contacts(model, chosen, planes)
        notes.append(_contact_note(model, chosen, planes))
    optional_notes = overlap_note(model, chosen), _size_note(model, bed), _numpy_note()
    notes.extend(line for line in optional_notes if line)

    # Before anything is changed: a filter may turn warnings into errors.
    for line in notes:
        warn(line)
    return Sand(model, bed, element, notes, exclusion, hulls)


def _height_field(
    model: mujoco.MjModel, level: float | str, slope: float
) -> tuple[Hills, list[int]]:
    """Return the surface of the height field that ``level`` names, and the number of
    its geom in a list; `FLAT` and an empty list for a number. Refusal for a slope as
    well."""
    if not isinstance(level, str):
        return FLAT, []
    require(not slope, "a height field has its own slopes", instead="remove ``slope``")
    hills, geom = hills_of(model, level)
    return hills, [geom]


def _require_free(model: mujoco.MjModel, geoms: Sequence[int]) -> None:
    """Raise Refusal for geoms that are in sand already."""
    in_sand = {int(g) for bed in installed.beds(model) for g in bed.geoms.ids}
    taken = sorted(in_sand & {*geoms})
    names = ", ".join(formatted(geom_name(model, g)) for g in taken[:3])
    require(
        not taken,
        f"sand is already attached to {names}",
        instead="detach it, or choose other geoms",
    )


def _slope(
    model: mujoco.MjModel, slope: float, effects: Sequence[GroundEffect]
) -> tuple[float, tuple[GroundEffect, ...]]:
    """Return the angle by which the surface rises, rad, given as a number or as an
    effect, and all effects. Refusal for both, for a mass, which the model has, and for
    gravity that is tilted already."""
    effects = checked_effects(effects)
    slopes = [effect for effect in effects if isinstance(effect, Slope)]
    g_x, g_y, g_z = model.opt.gravity
    require(
        not (slope or slopes) or abs(g_x) + abs(g_y) <= 1e-9 * abs(g_z),
        "gravity is not along -z",
        because="a slope inclines the surface under a model whose z is up",
        instead="set gravity along -z",
    )
    if not slopes:
        return slope, (*effects, Slope(slope)) if slope else effects
    require(
        not slope,
        "the slope is given twice",
        instead="remove ``slope``, or the effect",
    )
    require(
        not slopes[0].mass,
        "the bodies of the model have masses of their own",
        instead="remove ``mass`` of the slope",
    )
    return slopes[0].angle, effects


def _ground(rounding: float | None, effects: Sequence[GroundEffect]) -> Ground:
    """Return the state of the ground with these effects."""
    rounding = ROUNDING if rounding is None else rounding
    in_range("rounding", rounding, 1e-7, 10, unit="m/s")
    return ground_of(effects, Ground(rounding=rounding))


def with_footprints(
    model: mujoco.MjModel, bed: Bed, footprints: Footprints, hulls: bool = False
) -> Bed:
    """Return a bed that remembers footprints; Refusal where there is no memory for
    them."""
    require(
        installed.serves_compiled(),
        "footprints need compiled code",
        instead="pip install 'geomech[fast]'",
    )
    others = any(other.userdata_size for other in installed.beds(model))
    require(
        not others,
        "another sand in this model has a memory",
        instead="attach all geoms at once",
    )
    bed = replace(bed, prints=_prints(model, bed, footprints, hulls))
    size = bed.userdata_size
    require(
        model.nuserdata >= size,
        f"footprints need {size} numbers of userdata, the model has {model.nuserdata}",
        instead=f'write <size nuserdata="{size}"/> in its MJCF, or spec.nuserdata',
    )
    return bed


def _prints(
    model: mujoco.MjModel, bed: Bed, footprints: Footprints, hulls: bool
) -> Prints:
    """Return the grid of footprints over a bed, and the points of its geoms that press
    the ground."""
    require(
        isinstance(footprints, Footprints),
        "footprints must be rft.mujoco.Footprints",
        value=footprints,
    )
    # Points half a cell apart leave no cell between them untouched.
    half = footprints.spacing / 2
    ids = list(bed.geoms.ids)
    points = [mesh.vertices for mesh in meshes(model, ids, half, hulls)]
    first = np.cumsum([0, *map(len, points)]).astype(np.int64)

    shape = footprints.shape
    places = np.stack(np.meshgrid(*footprints.middles), -1).reshape(-1, 2)
    at_zero = np.concatenate([places, np.zeros((len(places), 1))], 1)
    up, level = bed.surface.planes(at_zero)
    heights = (level - (up[:, :2] * places).sum(-1)) / up[:, 2]

    grid = footprints.grid
    identity = repr((shape, len(points), *grid[:3])).encode()
    return Prints(
        shape,
        len(points),
        np.append(grid, zlib.crc32(identity) + 1),
        heights.reshape(shape),
        np.concatenate(points),
        first,
    )


def meshes(
    model: mujoco.MjModel,
    geoms: Sequence[int],
    element: float | None = None,
    hulls: bool = False,
) -> list[Mesh]:
    """Return the meshes of geoms in their frames, with edges of about ``element``, m,
    or as each geom's shape needs. hulls: whether meshes without an inside stand for
    their convex hulls."""
    own_meshes = []
    for geom in geoms:
        with located(f"the geom {geom_label(model, geom)}"):
            own_meshes.append(mesh_of_elements(model, geom, element, hulls))
    return own_meshes


def _shape_numbers(model: mujoco.MjModel, geoms: Sequence[int]) -> np.ndarray:
    """Return the numbers of a model that the elements of geoms follow from, (G, 5)."""
    kinds = np.stack([model.geom_type[geoms], model.geom_dataid[geoms]], -1)
    return np.concatenate([model.geom_size[geoms], kinds], axis=1)


def _may_touch(model: mujoco.MjModel, geoms: Sequence[int], plane: int) -> bool:
    """Return whether any of the geoms may touch a plane."""
    contype = model.geom_contype
    conaffinity = model.geom_conaffinity
    geoms_touch = contype[geoms] & conaffinity[plane]
    plane_touches = conaffinity[geoms] & contype[plane]
    return bool((geoms_touch | plane_touches).any())


def _contact_note(
    model: mujoco.MjModel, geoms: Sequence[int], planes: Sequence[int]
) -> str:
    """Return the line about the floor that the geoms pass through."""
    names = " and ".join(formatted(geom_name(model, g)) for g in planes)
    subject = "the geom no longer touches"
    if len(geoms) > 1:
        subject = f"{len(geoms)} geoms no longer touch"
    return f"{subject} the floor {names}, which lies at the surface of the sand"


def _size_note(model: mujoco.MjModel, bed: Bed) -> str:
    """Return a line about more elements than steps in real time allow, or "" for
    few."""
    counts = np.diff(bed.blocks.first)
    if counts.sum() <= MANY_ELEMENTS:
        return ""
    largest = int(np.argmax(counts))
    return (
        f"the sand has {counts.sum():,} elements, {counts[largest]:,} of them on the "
        f"geom {geom_label(model, bed.geoms.ids[largest])}: steps will be slow; "
        "choose fewer geoms, or a longer element"
    )


def _numpy_note() -> str:
    """Return a line about steps without numba, or "" with it."""
    if installed.serves_compiled():
        return ""
    return (
        f"the sand runs through a Python callback, about {NUMPY_TIME_RATIO} times "
        "slower: pip install 'geomech[fast]'"
    )


def require_passive(model: mujoco.MjModel) -> None:
    """Raise Refusal if the model's flags switch passive forces off."""
    flag = getattr(mujoco.mjtDisableBit, "mjDSBL_PASSIVE", None)
    disabled = flag is not None and model.opt.disableflags & int(flag)
    require(
        not disabled,
        "passive forces are disabled in the model",
        instead='remove <flag passive="disable"/>',
    )
