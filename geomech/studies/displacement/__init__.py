"""Displacements per cycle: by tiers, amplitudes and sweeps of parameters."""
