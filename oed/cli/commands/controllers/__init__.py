"""Commands that play experiments, on a controller or a virtual robot."""
