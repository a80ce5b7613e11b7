"""Parts of the frozen sets: what is run, and how two runs are compared."""
