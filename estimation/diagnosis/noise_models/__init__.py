"""Noise of the torque: its spectrum, the whitening filters, the usable frequency bands, and the masked rows."""
