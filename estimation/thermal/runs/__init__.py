"""Friction torques and temperatures out of logs: what a thermal fit is given."""
