"""Parts of the benchmark of the diagnosis on robots that a physics engine integrates."""
