"""Constants that decide: what is accepted, rejected or reported."""

from __future__ import annotations

MIN_BIC_GAIN = 10.0
"""An effect is reported if its model's BIC is better by this much: very strong evidence (Kass and Raftery 1995)."""

CLOSE_RIVAL_BIC = 10.0
"""A rival whose BIC is worse by less than this stays possible: the verdict is then ``ambiguous``."""
