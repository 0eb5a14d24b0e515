"""Force laws and stress maps fitted to measured drag."""
