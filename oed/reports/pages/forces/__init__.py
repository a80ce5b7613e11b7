"""Pages of external forces and contacts."""
