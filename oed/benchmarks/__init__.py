"""The hidden-effect benchmark: blind cases, answers of any tool, and their scores."""
