"""Bodies, one a file."""

from rft.bodies.backbone import Backbone, ConstantCurvature, Serpenoid
from rft.bodies.base import Body, Elements
from rft.bodies.chain import Chain

KINDS = {"chain": Chain, "backbone": Backbone, "serpenoid": Serpenoid, "constant-curvature": ConstantCurvature}

__all__ = ["KINDS", "Backbone", "Body", "Chain", "ConstantCurvature", "Elements", "Serpenoid"]
