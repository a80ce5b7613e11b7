"""What single joints have: limits that depend on their position, and how a controller counts them."""
