"""Verbs and results that turn logs into an identified model."""
