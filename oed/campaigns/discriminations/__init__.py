"""Experiments that tell two possible causes apart."""
