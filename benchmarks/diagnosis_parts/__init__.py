"""Parts of the benchmark of the diagnosis."""
