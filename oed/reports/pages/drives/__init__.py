"""The page of identified drives."""
