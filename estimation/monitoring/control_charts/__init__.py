"""Control charts: the healthy level of each quantity, thresholds, and steps fitted after an alarm."""
