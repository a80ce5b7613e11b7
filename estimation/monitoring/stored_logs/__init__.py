"""Stored logs: read, put on one clock, and sent through a monitor."""
