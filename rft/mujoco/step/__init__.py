"""A time step of a MuJoCo model in sand: forces by the velocity at the end of the
step."""
