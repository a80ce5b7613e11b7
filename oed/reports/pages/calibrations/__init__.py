"""Pages of calibrations and of designs of poses."""
