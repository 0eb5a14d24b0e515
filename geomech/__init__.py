"""Geometric mechanics of locomotion: connections, curvature constraint functions, displacement of gaits."""

__version__ = "0.1.0"
