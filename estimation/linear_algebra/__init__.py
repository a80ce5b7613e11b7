"""Numerics that several parts of the estimation share."""
