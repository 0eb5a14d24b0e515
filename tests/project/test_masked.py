"""Masked arrays: NumPy's `asarray` drops the mask, and computes with what lies under
it."""

import numpy as np
import pytest

import geomech
import rft
from geomech.mathematics.gaits import GAITS
from geomech.mathematics.geometry import connection, coordinates, curvature, reconstruct
from geomech.mathematics.systems import SYSTEMS, as_system
from geomech.studies.scene_tables import SceneTables
from rft.core.refusal import Refusal
from rft.formulas import se2
from rft.laws import LAWS
from rft.laws.drag import rod_drag
from rft.terradynamics import meshes, plates
from rft.terradynamics.meshes.forces import law

ANGLES = np.ma.array([0.5, 0.3], mask=[True, False])
ROWS = np.ma.array(np.full((4, 2), 0.3), mask=np.eye(4, 2, dtype=bool))
POSES = np.ma.array(np.full((4, 3), 0.1), mask=np.eye(4, 3, dtype=bool))
GLASS, CHAIN = rft.Granular(1.8, 0.24), rft.Chain()
STUDY = geomech.load("three-link-viscous")


def linear(alpha, alphadot):
    return np.concatenate([alphadot, alphadot[..., :1] * alpha[..., :1]], -1)


AXES = (np.linspace(-1, 1, 5),) * 2
A = connection.fit(linear, AXES)
CALLS = {
    "body_velocity": lambda: rft.body_velocity(GLASS, CHAIN, ANGLES, [1.0, 0.0]),
    "rates": lambda: rft.body_velocity(GLASS, CHAIN, [1.0, 0.0], ANGLES),
    "time_steps": lambda: rft.time_steps(GLASS, CHAIN, ROWS, ROWS),
    "work_done": lambda: rft.work_done(GLASS, CHAIN, [0.1, 0.2], [1.0, 0.0], POSES[0]),
    "points": lambda: CHAIN.points(ANGLES),
    "pose of points": lambda: CHAIN.points([0.1, 0.2], POSES[0]),
    "frame_pose": lambda: CHAIN.frame_pose("link-1", ANGLES, [1.0, 0.0]),
    "lengths": lambda: rft.Chain(np.ma.array([1.0, 2.0], mask=[0, 1])),
    "compose": lambda: se2.compose(POSES, POSES),
    "inverse": lambda: se2.inverse(POSES),
    "connection": lambda: A(ANGLES),
    "axes": lambda: connection.fit(linear, (ANGLES, AXES[1])),
    "ccf": lambda: curvature.ccf(A)(ANGLES),
    "velocity of another": lambda: as_system(linear, 2).velocity(ANGLES, [1.0, 0.0]),
    "poses": lambda: reconstruct.poses(POSES),
    "displacement": lambda: reconstruct.displacement(POSES),
    "frame of a velocity": lambda: coordinates.change_velocity(POSES, POSES, POSES),
    "amplitudes": lambda: SceneTables(STUDY).displacements(ANGLES),
    "cycle": lambda: STUDY.cycle(amplitudes=ANGLES),
    "poses of a tier": lambda: SceneTables(STUDY).poses("direct", amplitudes=ANGLES),
    "data": lambda: rod_drag(ANGLES, [1.0, 1.0], [1.0, 1.0]),
    "stress": lambda: plates.StressMap()(ANGLES, 0.5),
    "poses of a plate": lambda: plates.loads(
        plates.StressMap(), plates.Plate(0.1, 0.1), POSES, POSES
    ),
    "spatial stress": lambda: law.alpha_of_angles(ANGLES, 0.5, 0.5),
    "vertices": lambda: meshes.Mesh(POSES, [[0, 1, 2]]),
}
CALLS |= {
    f"shape of {name}": lambda gait=gait: gait.shape(ANGLES)
    for name, gait in GAITS.examples().items()
}
CALLS |= {
    f"rate of {name}": lambda gait=gait: gait.rate(ANGLES)
    for name, gait in GAITS.examples().items()
}
CALLS |= {
    f"traction of {name}": lambda law=law: law.traction(ANGLES, 0.0)
    for name, law in LAWS.examples().items()
}
CALLS |= {
    f"velocity of {name}": lambda x=x: x.velocity(
        np.ma.array(np.full(x.joints, 0.1), mask=True), np.ones(x.joints)
    )
    for name, x in SYSTEMS.examples().items()
}


@pytest.mark.parametrize("name", CALLS)
def test_masked_values_are_refused(name):
    with pytest.raises(Refusal, match="masked"):
        CALLS[name]()


def test_a_mask_that_hides_nothing_is_none():
    bare = np.ma.array([0.5, 0.3], mask=False)
    np.testing.assert_array_equal(CHAIN.points(bare), CHAIN.points([0.5, 0.3]))


def test_what_a_velocity_masks_is_singular_where_singular_shapes_are_allowed():
    class Hidden:
        joints = 1
        traits = geomech.mathematics.systems.base.Traits(
            singularity=lambda alpha: alpha[..., 0]
        )

        def velocity(self, alpha, alphadot):
            xi = np.concatenate([alphadot, alphadot, alphadot], -1)
            return np.ma.array(xi, mask=np.repeat(alpha < 0.1, 3, -1))

    found = as_system(Hidden()).velocity([[0.0], [0.5]], [[1.0], [1.0]])
    assert np.isnan(found[0]).all() and (found[1] == 1).all()
