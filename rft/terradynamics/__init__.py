"""Terradynamics: forces of grains on plates, meshes and walking robots, in the vertical
plane and in three dimensions."""
