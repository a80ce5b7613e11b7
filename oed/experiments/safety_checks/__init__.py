"""How far a motion stays from every limit."""
