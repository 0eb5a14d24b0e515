"""Velocities, motions and forces of one swimmer."""
