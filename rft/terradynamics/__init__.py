"""Terradynamics: forces of grains on plates, meshes and robots in the vertical plane and in
space."""
