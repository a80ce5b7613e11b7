"""Files of `oed example`: a virtual robot, and two logs in which a hidden effect acts."""
