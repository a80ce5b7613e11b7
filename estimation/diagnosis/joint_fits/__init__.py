"""Effects and base model fitted together."""
