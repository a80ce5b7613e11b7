"""A robot in 3-D that plays a motion in the browser: surfaces of its links, flange path, obstacles, limits in use."""
