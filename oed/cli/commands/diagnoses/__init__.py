"""Commands that say what is wrong, and what changed."""
