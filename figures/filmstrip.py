"""A strip of pictures: the butterfly gait in loose glass, on the ground and on the CCF map."""

from __future__ import annotations

from figures import main
from geomech import plots
from geomech.scenes import load
from geomech.studies.motion import motion
from geomech.studies.study import Study


def compute(scene: str = "butterfly-glass", cycles: int = 1, **numerics) -> dict:
    """Return the motion (`geomech.studies.motion.Motion`), and the CCF with its error."""
    study = Study(load(scene).with_numerics(**numerics))
    return {
        "motion": motion(study.scene, cycles),
        "ccf": study.curvature,
        "error": study.curvature_error,
    }


def draw(numbers: dict):
    return plots.filmstrip(numbers["motion"], numbers["ccf"], numbers["error"])


if __name__ == "__main__":
    main("filmstrip", compute, draw)
