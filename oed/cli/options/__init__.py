"""Groups of options that commands share, and what they are made into."""
