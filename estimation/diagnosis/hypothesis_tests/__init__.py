"""The whitened regression and the test statistics of each effect at each joint."""
