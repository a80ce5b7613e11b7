"""Designed and retimed experiments, and their files."""
