"""Recordings: the logs of one robot, made ready once for all that is asked of them."""

from estimation.recordings.recording import Recording, make_ready

__all__ = ["Recording", "make_ready"]
