"""Validation of findings against generic alternatives and on held-out data, and the verdict."""
