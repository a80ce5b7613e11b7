"""What effects are made of: base classes, parameters, and states that several share."""
