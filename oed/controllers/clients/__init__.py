"""The client: checks a trajectory and a controller, sends the points, watches, and stops the robot at every end."""
