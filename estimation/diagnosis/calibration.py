"""Constants that decide: what is accepted, rejected or reported."""

from __future__ import annotations

MIN_BIC_GAIN = 10.0
"""An effect is reported if its model's BIC is better by this much: very strong evidence (Kass and Raftery 1995)."""

CLOSE_RIVAL_BIC = 10.0
"""A rival whose BIC is worse by less than this stays possible: the verdict is then ``ambiguous``."""

MIN_EXPLAINED_SHARE = 0.7
"""Named effects that explain less than this share of the significant residual, or of what free functions explain in
their place, do not explain it."""

NEARLY_EXPLAINED_SHARE = 0.9
"""Nor do those that explain less than this share and have a worse BIC: formulas are true to some per cent."""

MIN_RETAINED_CHI2 = 0.75
"""A name must explain this share of its chi-square beside free functions elsewhere, or it borrowed it from them."""
