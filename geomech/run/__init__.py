"""Long computations: tasks computed by any executor, their results stored by content, so that a stopped request resumes."""

BELOW = (
    "OMP_NUM_THREADS",
    "OPENBLAS_NUM_THREADS",
    "MKL_NUM_THREADS",
)  # read by the libraries below NumPy
