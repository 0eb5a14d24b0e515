"""Long computations by hand, whose results are shipped as CSV files beside the
scripts."""
