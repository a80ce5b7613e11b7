"""Plain methods to compare with: they use numpy, scipy and pinocchio alone, and nothing of the diagnosis."""
