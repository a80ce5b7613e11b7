"""From logs to clean motion: one grid, derivatives, directions, and which rows count."""
