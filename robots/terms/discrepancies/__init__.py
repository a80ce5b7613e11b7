"""Generic model errors, fitted where no effect of the catalogue explains the residual."""
