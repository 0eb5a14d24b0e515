"""Intruders and robots in the vertical plane, and media fitted to measured drag."""
