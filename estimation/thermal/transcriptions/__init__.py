"""A thermal fit as a nonlinear program: mesh, coordinates, search, solver, information."""
