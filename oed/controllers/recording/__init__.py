"""Feedback of a controller into a log, written as it comes."""
