"""A program of a user's, on which `mypy --strict` finds nothing (.ci/run) and which
runs (test_top.py)."""

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes

import geomech
import rft
from geomech import geometry, plots
from geomech.core.variables import Result, Variable
from geomech.mathematics import symbolic
from geomech.mathematics.gaits import (
    Butterfly,
    Circle,
    Ellipse,
    Fourier,
    Gait,
    Points,
    Sine,
)
from geomech.mathematics.geometry import family
from geomech.mathematics.geometry.representations import harmonics
from geomech.mathematics.geometry.traits import Traits
from geomech.mathematics.systems import NoSlipSnake, Swimmer
from geomech.mathematics.systems.base import integrated
from geomech.mathematics.tiers.area import area
from geomech.mathematics.tiers.direct import direct
from geomech.mathematics.tiers.path import path
from geomech.scenes import (
    Numerics,
    Scene,
    from_tables,
    inputs,
    load,
    parse,
    tables,
    toml,
)
from geomech.studies.displacement.choose import cheapest_displacements
from geomech.studies.displacement.sweep import sweep
from geomech.studies.estimates import cost
from geomech.studies.mechanics import undulation
from geomech.studies.scene_tables import SceneTables
from rft import Chain, Granular, body_velocity, time_steps, work_done

Array = npt.NDArray[np.float64]
sand, swimmer = Granular(C=1.8, gamma0=np.radians(13.8)), Chain(lengths=(1, 1, 1))


def velocity(alpha: Array, alphadot: Array) -> Array:
    return body_velocity(sand, swimmer, alpha, alphadot).checked().xi


class Mine:
    """A law of traction alone."""

    def traction(self, v_t: Any, v_n: Any, eps: float = 0.0) -> tuple[Any, Any]:
        return v_t, 2 * v_n


@geomech.register
@dataclass(frozen=True)
class Cart:
    """Rolls as its first joint turns."""

    kind = "cart"
    joints = 2
    length = 1.0
    traits = Traits(linear=True)
    run = integrated

    def velocity(self, alpha: Array, alphadot: Array) -> Array:
        return np.stack(
            [alphadot[..., 0], 0 * alphadot[..., 0], 0 * alphadot[..., 0]], -1
        )


def connections() -> list[Any]:
    fitted = geometry.connection.fit(
        velocity, geometry.connection.grid(joints=2, points=5)
    )
    ccf = geometry.curvature.ccf(fitted)
    figure, axes = geomech.plots.figure(3.0, 3.0)
    over = ("tier", "amplitude")
    x = Variable("x", over, np.zeros((1, 2)), "BL")
    coordinates = (
        Variable("tier", over[:1], ["area"]),
        Variable("amplitude", over[1:], [0.5, 1.0]),
    )
    plots.displacement(Result("displacement", (*coordinates, x)), ax=axes[0, 0])
    plots.ccf_figure(ccf, [Circle()])
    nets: list[Array] = [
        area(ccf, Circle(), [0.5]),
        path(fitted, Circle(), [0.5]),
        direct(velocity, Circle(), [0.5]),
    ]
    table = family.fit(velocity, Circle(), 1.0, 6)
    return [
        *nets,
        fitted.A,
        table,
        figure,
        geometry.reconstruct.displacement(np.zeros((4, 3))),
        harmonics.fit,
        symbolic.velocity,
    ]


def scenes() -> list[Any]:
    scene: Scene = geomech.load("three-link-viscous").with_numerics(grid=7, phases=32)
    text: str = toml(scene.changed(gait=Circle(amplitude=0.3)))
    study: SceneTables = geomech.Study(scene).tables
    net: Array = study.poses("area", amplitudes=[0.5])
    face = geomech.study("three-link-viscous", grid=7, phases=32)
    numbers: Result = face.displacement([0.5], tiers="area")
    numbers = geomech.displacement("three-link-viscous", [0.5], tolerance=1e-3)
    drawn: Axes = plots.ccf_map(face.tables.curvature, gaits=[Circle()])
    told = (
        study.displacements([0.5, 1.0], ["direct"]),
        study.cost([0.5], ["direct"]),
        study.with_numerics(phases=64),
    )
    more = (
        study.fitted,
        study.curvature,
        study.tiers,
        cheapest_displacements(scene, [0.5], 1e-3),
        sweep(scene, {"gait.amplitude": [0.5]}),
    )
    asked = (
        geomech.fit_log,
        geomech.studies.measured.Fitted,
        geomech.accuracy,
        cost.total_cost,
        undulation.performance,
        undulation.activation,
        text,
        net,
    )
    return [
        parse(text),
        tables(scene),
        from_tables(tables(scene)),
        inputs(scene),
        load("no-slip-snake"),
        told,
        more,
        asked,
        (numbers["tier"].values, drawn),
    ]


def mechanics() -> list[Any]:
    gaits: list[Gait] = [Butterfly(), Ellipse(semi_axes=(1.0, 0.3)), Sine(elements=8)]
    gaits += [
        Points(points=((1, 0), (0, 1), (-1, 0))),
        Fourier(cos=((1.0,), (0.0,)), sin=((0.0,), (1.0,))),
    ]
    cycle = Swimmer(sand, swimmer, (rft.EndCaps(radius=0.06),)).run(
        *Circle().cycle(32, [0.5])
    )
    steps = time_steps(
        sand,
        swimmer,
        np.zeros((8, 2)),
        np.ones((8, 2)),
        effects=[rft.Transient(0.1)],
        cycles=1,
    )
    power: Array = work_done(
        sand, swimmer, [0.0, 0.1], [1.0, 0.0], [0.0, 0.0, 0.0]
    ).power
    own = (
        Scene(Swimmer(Mine(), swimmer), Circle(), Numerics(grid=7)),
        Scene(Cart(), Circle()).cycle(phases=8).net,
    )
    media = (
        rft.CATALOGUE["coulomb"].medium.traction(1.0, 0.5),
        rft.Viscous(2.0).slopes(1.0, 2.0, 0.0),
        geomech.media.LAWS,
    )
    return [
        gaits,
        cycle.net,
        steps.xi,
        power,
        own,
        media,
        NoSlipSnake().velocity([0.1, 0.3], [1, 0]),
        geomech.__version__,
    ]
