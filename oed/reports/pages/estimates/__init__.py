"""Parts of the page of an identification."""
