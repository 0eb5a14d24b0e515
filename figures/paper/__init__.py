"""Figures of Zhang and Goldman (2014)."""
