"""Beds of grains: drag on rods, and swimmers."""
