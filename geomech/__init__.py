"""Geometric mechanics of locomotion: from a force law to the displacement of a gait.

    study = geomech.study("three-link-glass")  # or a TOML file, or its parts
    table = study.displacement([0.5, 1.0])     # with errors; .plot(), .save("a.nc")
    study.ccf().plot()                         # also .connection(), .optimise()

Every question of the command line is a function of the same name:

- of a scene: displacement, ccf, connection, velocity, sweep, run, accuracy, forces,
  optimise (optimize), trajectory, intrude, walk, grains;
- of measurements: fit_medium, fit_gait;
- of a medium of the vertical plane: stress; of a rod in grains: drag_grains.

The questions of a scene are methods of a study as well: study, Study. Other names:

- load, Scene, Swimmer, Numerics, toml: scenes, read, built and written.
- media, bodies, gaits, effects, systems: the parts of scenes; register adds yours;
  medium is a force law or a stress map, by its name or from a file.
- load_result, best_scene, fitted_medium, fitted_gait: results from files, and the
  scene, medium or gait that a result has found.
- measured, fit_log: logs and midlines, stage by stage.
- geometry: connections, CCFs and metrics of any velocity(alpha, alphadot).
- symbolic: connections and CCFs as formulas.
- tiers: the methods of prediction. undulation: swimmers that undulate.
- plots: figures. workers: processes for long computations.
- Refusal: the error for whatever makes no sense, a ValueError with its facts.

On the command line: `geomech --help`; every key of a scene file: `geomech reference`.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING

from geomech.core import version as _version
from geomech.shell import face as _face  # noqa: F401  implements methods of values

if TYPE_CHECKING:  # the names of `__getattr__`, for type checkers and editors
    from geomech import plots as plots
    from geomech.api import Study as Study
    from geomech.api import accuracy as accuracy
    from geomech.api import ccf as ccf
    from geomech.api import connection as connection
    from geomech.api import displacement as displacement
    from geomech.api import drag_grains as drag_grains
    from geomech.api import fit_gait as fit_gait
    from geomech.api import fit_medium as fit_medium
    from geomech.api import forces as forces
    from geomech.api import grains as grains
    from geomech.api import intrude as intrude
    from geomech.api import load_result as load_result
    from geomech.api import optimise as optimise
    from geomech.api import optimize as optimize
    from geomech.api import run as run
    from geomech.api import stress as stress
    from geomech.api import study as study
    from geomech.api import sweep as sweep
    from geomech.api import trajectory as trajectory
    from geomech.api import velocity as velocity
    from geomech.api import walk as walk
    from geomech.mathematics import gaits as gaits
    from geomech.mathematics import geometry as geometry
    from geomech.mathematics import symbolic as symbolic
    from geomech.mathematics import systems as systems
    from geomech.mathematics import tiers as tiers
    from geomech.mathematics.systems import Swimmer as Swimmer
    from geomech.results.measured import fitted_gait as fitted_gait
    from geomech.results.scenes import best_scene as best_scene
    from geomech.results.scenes import fitted_medium as fitted_medium
    from geomech.runs import workers as workers
    from geomech.scenes import Numerics as Numerics
    from geomech.scenes import Scene as Scene
    from geomech.scenes import load as load
    from geomech.scenes import toml as toml
    from geomech.scenes.kinds import register as register
    from geomech.scenes.read import medium as medium
    from geomech.studies import measured as measured
    from geomech.studies.measured import fit_log as fit_log
    from geomech.studies.mechanics import undulation as undulation
    from rft import bodies as bodies
    from rft import effects as effects
    from rft import laws as _laws
    from rft.core.refusal import Refusal as Refusal

    media = _laws

__version__ = _version.VERSION

_MODULES = {  # by their names here; none is imported before its first use
    **{
        name: f"geomech.mathematics.{name}"
        for name in ("gaits", "geometry", "symbolic", "systems", "tiers")
    },
    "measured": "geomech.studies.measured",
    "plots": "geomech.plots",
    **{name: f"rft.{name}" for name in ("bodies", "effects")},
    "media": "rft.laws",
    "undulation": "geomech.studies.mechanics.undulation",
    "workers": "geomech.runs.workers",
}
_OBJECTS = {
    **dict.fromkeys(
        (
            "Study",
            "accuracy",
            "ccf",
            "connection",
            "displacement",
            "drag_grains",
            "fit_gait",
            "fit_medium",
            "forces",
            "grains",
            "intrude",
            "load_result",
            "optimise",
            "optimize",
            "run",
            "stress",
            "study",
            "sweep",
            "trajectory",
            "velocity",
            "walk",
        ),
        "geomech.api",
    ),
    **dict.fromkeys(("best_scene", "fitted_medium"), "geomech.results.scenes"),
    "fitted_gait": "geomech.results.measured",
    **dict.fromkeys(("load", "toml", "Scene", "Numerics"), "geomech.scenes"),
    "medium": "geomech.scenes.read",
    "Swimmer": "geomech.mathematics.systems",
    "fit_log": "geomech.studies.measured",
    "register": "geomech.scenes.kinds",
    "Refusal": "rft.core.refusal",
}


def __getattr__(name: str) -> object:
    if name in _MODULES:
        value = import_module(_MODULES[name])
    elif name in _OBJECTS:
        value = getattr(import_module(_OBJECTS[name]), name)
    else:
        raise AttributeError(f"module 'geomech' has no attribute {name!r}")
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({*_MODULES, *_OBJECTS, "__version__"})
