"""Figures of accuracy and its cost."""
