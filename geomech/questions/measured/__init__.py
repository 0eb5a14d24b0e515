"""Questions to measured data: gaits, midlines and drag."""
