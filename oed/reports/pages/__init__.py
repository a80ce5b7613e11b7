"""One page a result."""
