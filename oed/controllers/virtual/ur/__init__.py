"""A UR controller to test against: it runs the programs that it is sent, and reports by RTDE."""
