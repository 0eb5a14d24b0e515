"""Long computations, started by hand; their results are the CSV files next to the
scripts."""
