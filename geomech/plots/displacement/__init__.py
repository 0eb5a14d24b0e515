"""Figures of displacements: against amplitude, parameters and cost."""
