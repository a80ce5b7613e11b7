"""Sources of programs that are exported as they are."""
