"""Pages of monitors and fleets."""
