"""Figures of bodies that move through grains."""
