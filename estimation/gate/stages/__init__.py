"""A log at each stage of its check: as recorded, cleaned, smoothed, fitted. All numbers are computed on demand."""
