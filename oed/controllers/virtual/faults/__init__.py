"""What goes wrong on the way to a robot, and on its path."""
