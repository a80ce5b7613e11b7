"""ABB's Externally Guided Motion (EGM): positions in each cycle, by UDP."""
