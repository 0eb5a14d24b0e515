"""Sand under the geoms of any MuJoCo model: resistive forces in ``mj_step``, by one
call. Needs MuJoCo.

with rft.mujoco.attach(model, "poppy-seeds-loose") as sand:
    mujoco.mj_step(model, data)
    print(sand.forces(data), sand.power(data))
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from rft.core.refusal import Refusal

if TYPE_CHECKING:
    from rft.mujoco.sand import Footprints, Sand, attach, sample

__all__ = ["Footprints", "Sand", "attach", "sample"]


def __getattr__(name: str) -> Any:
    """Import a name at its first use, for that needs MuJoCo."""
    if name not in __all__:
        raise AttributeError(f"module 'rft.mujoco' has no attribute {name!r}")
    try:
        from rft.mujoco import sand
    except ModuleNotFoundError as error:
        if error.name != "mujoco":
            raise
        raise Refusal(
            "rft.mujoco needs MuJoCo", instead="pip install 'geomech[mujoco]'"
        ) from None
    return getattr(sand, name)


def __dir__() -> list[str]:
    return __all__
