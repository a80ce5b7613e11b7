"""Search for the effects that enter the extended model."""
