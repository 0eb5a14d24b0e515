"""Questions to beds of grains."""
