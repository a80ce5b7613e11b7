"""The observer sample by sample: in Python, and as C."""
