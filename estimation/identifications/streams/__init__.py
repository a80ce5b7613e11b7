"""Identification of logs larger than the memory: a survey, pieces, their sums, and the verb."""

from estimation.identifications.streams.identification import METHODS, identify_stream

__all__ = ["METHODS", "identify_stream"]
