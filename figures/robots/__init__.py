"""Figures of robots on grains."""
