"""Bodies in motion: time steps, limit cycles and the work that is done."""
