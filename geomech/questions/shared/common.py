"""Options that several questions and pictures share."""

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any

from geomech.questions.shared import parsing
from geomech.questions.shared.base import Option

PANELS = "panels to draw, such as x or x,theta"
LIMIT = "limit of the colours, a number or percentiles as 98% or 5%:95%"

ColourLimit = Annotated[Any, Option(LIMIT, "LIMIT", parsing.colour_limit)]
Panels = Annotated[Sequence[str], Option(PANELS, "NAMES", parsing.panels)]
CurvePanels = Annotated[Sequence[str], Option(PANELS, "NAMES", parsing.curve_panels)]
Pair = Annotated[
    Any, Option("joints on the axes, as 1,3; all pairs if left out", "I,J")
]
Slice = Annotated[
    Any,
    Option(
        "angles of the joints that are held, as 0.3 or 0.3,-20deg",
        "ANGLES",
        parsing.angles,
    ),
]
OtherFrame = Annotated[
    str | None,
    Option("draw another body frame below, on the same scales", "FRAME"),
]
Store = Annotated[
    Path | None,
    Option(
        "folder of settled beds and runs, the user's cache if left out",
        "DIR",
        parsing.folder,
    ),
]
