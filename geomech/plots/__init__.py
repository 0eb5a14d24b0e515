"""Plots of results and of what they are computed from.

A plot draws on the Axes that it is given and returns it. Without any it draws on
pyplot's current Axes if a figure of pyplot is open, else on new ones, which a notebook
shows.
Nothing here imports pyplot or changes its state.
"""

from geomech.plots.displacement.displacements import (
    PANELS,
    displacement,
    displacement_figure,
    medium_band,
    net,
)
from geomech.plots.displacement.precision import (
    SETTING_MARKER,
    accuracy_figure,
    work_precision,
)
from geomech.plots.displacement.sweeps import (
    curves,
    draw_maps_of_walks,
    sweep_figure,
)
from geomech.plots.figures import (
    ccf_figure,
    connection_figure,
    pairs_figure,
    plane_connection_figure,
    planes_figure,
)
from geomech.plots.forces import (
    force_map,
    forces_figure,
    stacked_by_phase,
    stacked_by_place,
)
from geomech.plots.look import Look, using
from geomech.plots.maps import (
    COMPONENTS,
    FINEST,
    HATCHED,
    RINGS,
    ccf_map,
    certain,
    draw_gait,
    drawable,
    frame_figure,
    indicatrices,
    largest,
    shape_space,
    unknown,
    vector_field,
)
from geomech.plots.measured.gaits import measured_figure
from geomech.plots.measured.midlines import midlines_figure
from geomech.plots.motion import LINES, filmstrip, stage
from geomech.plots.optimum import optimum_angles, optimum_figure, optimum_map
from geomech.plots.stretched import stretched_figure, stretched_map
from geomech.plots.style import (
    MARKED,
    STYLE,
    check_format,
    figure,
    quantity,
    save,
    shared_legend,
    styled,
)
from geomech.plots.styles import (
    CCF_STYLES,
    CONNECTION_STYLES,
    ccf_contours,
    ccf_surface,
    streamlines,
    winding,
)
from geomech.plots.terradynamics.drag import drag_figure
from geomech.plots.terradynamics.grains import grains_figure
from geomech.plots.terradynamics.intruders import (
    draw_stress,
    intrusion_figure,
    square_of_angles,
    stress_figure,
    stress_map,
)
from geomech.plots.terradynamics.plates import penetration_figure, plates_figure
from geomech.plots.terradynamics.walking import walk_figure, walk_strip

__all__ = [
    "CCF_STYLES",
    "COMPONENTS",
    "CONNECTION_STYLES",
    "FINEST",
    "HATCHED",
    "LINES",
    "MARKED",
    "PANELS",
    "RINGS",
    "SETTING_MARKER",
    "STYLE",
    "Look",
    "accuracy_figure",
    "ccf_contours",
    "ccf_figure",
    "ccf_map",
    "ccf_surface",
    "certain",
    "check_format",
    "connection_figure",
    "curves",
    "displacement",
    "displacement_figure",
    "drag_figure",
    "draw_gait",
    "draw_maps_of_walks",
    "draw_stress",
    "drawable",
    "figure",
    "filmstrip",
    "force_map",
    "forces_figure",
    "frame_figure",
    "grains_figure",
    "indicatrices",
    "intrusion_figure",
    "largest",
    "measured_figure",
    "medium_band",
    "midlines_figure",
    "net",
    "optimum_angles",
    "optimum_figure",
    "optimum_map",
    "pairs_figure",
    "penetration_figure",
    "plane_connection_figure",
    "planes_figure",
    "plates_figure",
    "quantity",
    "save",
    "shape_space",
    "shared_legend",
    "square_of_angles",
    "stacked_by_phase",
    "stacked_by_place",
    "stage",
    "streamlines",
    "stress_figure",
    "stress_map",
    "stretched_figure",
    "stretched_map",
    "styled",
    "sweep_figure",
    "unknown",
    "using",
    "vector_field",
    "walk_figure",
    "walk_strip",
    "winding",
    "work_precision",
]  # fmt: skip


def __dir__() -> list[str]:
    return __all__
