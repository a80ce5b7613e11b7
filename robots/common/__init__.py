"""Shared tools: errors, files, tables, configuration, parallel work, progress."""
