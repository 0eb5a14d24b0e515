"""Forces of grains on triangles by three-dimensional resistive force theory."""
