"""Readers of files: one format a file, each giving a table of columns."""
