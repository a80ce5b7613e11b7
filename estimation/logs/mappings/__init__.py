"""Mapping files: the meaning of a foreign log's columns."""
