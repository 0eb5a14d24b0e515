"""Figures of swimmers: gaits, frames, trials, transients and joints that give way."""
