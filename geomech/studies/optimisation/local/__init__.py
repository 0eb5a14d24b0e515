"""The ascent to an optimum: objectives, constraints and steps."""
