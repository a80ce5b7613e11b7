"""Universal Robots: state by RTDE, points by a program that the controller is sent."""
