"""The search for the best design, in one process or several."""
