"""The page of a loop of experiments."""
