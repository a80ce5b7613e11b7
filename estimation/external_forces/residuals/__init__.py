"""External joint torque of a log, before it is judged: momentum, friction level, and the observer's filter."""
