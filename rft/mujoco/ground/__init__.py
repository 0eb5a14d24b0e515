"""The ground of a MuJoCo model: where sand lies, its surface, and the geoms in it."""
