"""Foundations of geomech that know nothing of mechanics: refusals, notes, parts, results."""
