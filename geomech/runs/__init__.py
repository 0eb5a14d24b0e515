"""Long computations: tasks computed by any executor, their results stored by content,
so that a stopped request resumes."""

# Variables of the environment that the libraries below NumPy read.
THREAD_VARIABLES = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")
