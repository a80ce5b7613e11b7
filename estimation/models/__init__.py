"""Identified models: their files, their extensions, their predictions."""
