"""Figures of measured gaits and midlines."""
