"""Which effects enter the model."""
