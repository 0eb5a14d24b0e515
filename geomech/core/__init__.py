"""Foundations of geomech without mechanics: refusals, notes, parts, results."""
