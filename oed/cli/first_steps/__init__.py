"""What the commands for a first look write: examples, the effects, the installation."""
