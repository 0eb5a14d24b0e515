"""Functions of shape: on grids and planes, around a gait, by symmetry, over
directions."""
