"""Components of effects: base classes, parameters, and shared states."""
