"""The balance of forces: one formula of a Newton step, two drivers that apply it, and `body_velocity`."""

from rft.balance.velocity import Solution, body_velocity, checked_input

__all__ = ["Solution", "body_velocity", "checked_input"]
