"""Commands that make models of logs."""
