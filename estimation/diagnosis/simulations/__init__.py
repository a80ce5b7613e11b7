"""Forward simulation of held-out data with the base model and the extended model."""
