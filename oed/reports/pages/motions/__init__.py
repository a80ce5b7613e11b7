"""Pages and sections with the robot in 3-D."""
