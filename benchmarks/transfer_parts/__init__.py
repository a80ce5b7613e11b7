"""Parts of the transfer benchmark."""
