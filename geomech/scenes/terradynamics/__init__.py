"""Scenes of intruders and robots in granular ground."""
