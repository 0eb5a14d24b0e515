"""Figures of intruders, plates, robots and beds of grains."""
