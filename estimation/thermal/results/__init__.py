"""Results of thermal fits."""
