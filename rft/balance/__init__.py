"""The balance of forces: one formula of Newton's step, two drivers, and the body velocity that they find."""

from rft.balance.velocity import Solution, body_velocity, checked_input

__all__ = ["Solution", "body_velocity", "checked_input"]
