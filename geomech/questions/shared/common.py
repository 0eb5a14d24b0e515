"""Options that several questions and pictures share."""

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any

from geomech.questions.shared import parsing
from geomech.questions.shared.base import Option

PANELS = "panels to draw, such as x or x,theta"
LIMIT = "colour limit: a number, or percentiles 98% or 5%:95%"

ColourLimit = Annotated[Any, Option(LIMIT, "LIMIT", parsing.colour_limit)]
Panels = Annotated[Sequence[str], Option(PANELS, "NAMES", parsing.panels)]
CurvePanels = Annotated[Sequence[str], Option(PANELS, "NAMES", parsing.curve_panels)]
Pair = Annotated[
    Any, Option("joints on the axes, such as 1,3 (default all pairs)", "I,J")
]
Slice = Annotated[
    Any,
    Option(
        "angles of the fixed joints, such as 0.3 or 0.3,-20deg",
        "ANGLES",
        parsing.angles,
    ),
]
OtherFrame = Annotated[
    str | None,
    Option("also draw another body frame, on the same scales", "FRAME"),
]
Store = Annotated[
    Path | None,
    Option(
        "folder of settled beds and runs (default the user's cache)",
        "DIR",
        parsing.folder,
    ),
]
