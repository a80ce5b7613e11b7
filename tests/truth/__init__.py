"""A plant that shares no code with what it judges: numpy, scipy and pinocchio alone.

`cases.draw_case` hides effects in logs of t, q and tau; its effects are formulated otherwise than a catalogue's.
"""
