"""Measured data that scenes name."""
