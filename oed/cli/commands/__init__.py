"""The commands, one a file: thin shells over the functions of the same names."""
