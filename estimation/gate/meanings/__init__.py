"""What the columns of a log mean: readings, one fit that compares them, and the mapping that makes the log right."""
