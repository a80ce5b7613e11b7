"""Parts of the benchmark of calibrations."""
