"""Joint fits of effects and base model."""
