"""Measured midlines: from points tracked along a body to its kinematics, with
intervals, one stage a file."""
