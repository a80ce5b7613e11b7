"""Options from the fields of options classes: their parsers, their values, and what excludes what."""
