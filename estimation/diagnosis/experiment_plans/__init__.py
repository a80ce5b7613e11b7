"""Detection limits of logs and planned experiments, and the next experiment."""
