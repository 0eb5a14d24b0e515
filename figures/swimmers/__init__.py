"""Figures of swimmers: gaits, frames, trials and transients."""
