"""A log under other meanings: other columns, units or gravity, and multiples of the described torques."""
