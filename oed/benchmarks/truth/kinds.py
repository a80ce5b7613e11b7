"""The kinds of robots that the plant has."""

KINDS = ("ur10", "panda", "heavy", "er3a")
