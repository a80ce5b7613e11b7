"""Whether findings hold against generic alternatives and on held-out data."""
