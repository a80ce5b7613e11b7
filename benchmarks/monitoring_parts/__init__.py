"""Parts of the study of the monitor."""
