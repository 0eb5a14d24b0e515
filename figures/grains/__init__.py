"""Figures of beds of grains."""
