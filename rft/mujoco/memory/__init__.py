"""Where the numbers of a MuJoCo model and of a bed of sand lie in memory."""
