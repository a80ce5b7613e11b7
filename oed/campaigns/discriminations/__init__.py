"""Experiments that distinguish two possible causes."""
