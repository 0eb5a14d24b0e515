"""Robots that walk in the vertical plane: their equations, time steps and limit
cycles."""
