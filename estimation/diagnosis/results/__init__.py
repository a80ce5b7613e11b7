"""The result of a diagnosis and its text; nothing is decided here."""
