"""Robots that walk in three dimensions, as MuJoCo models."""
