"""Bodies, one file each."""

from rft.bodies.base import Body, Motion
from rft.bodies.chain import Chain

KINDS = {"chain": Chain}

__all__ = ["KINDS", "Body", "Chain", "Motion"]
