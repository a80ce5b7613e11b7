"""Pictures from plain arrays, free of any drawing library."""
