"""Reading of logs: uniform grid, low-passed motion and its derivatives, direction of motion, rows that count."""
