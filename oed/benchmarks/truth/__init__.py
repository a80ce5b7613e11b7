"""An independent plant: it uses only numpy, scipy and pinocchio, and no code of the packages under test.

`cases.draw_case` hides effects in logs of t, q and tau. Their formulas differ from those of the effect catalogue.
"""
