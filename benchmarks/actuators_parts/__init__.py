"""Virtual plants in MuJoCo, and rivals, for the benchmark of drives."""
