"""Surfaces of bodies as triangles: their shapes, files and geometry."""
