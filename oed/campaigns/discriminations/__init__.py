"""Experiments that distinguish two possible causes."""

from oed.campaigns.discriminations.design import discriminate
from oed.campaigns.discriminations.discrimination import Discrimination

__all__ = ["Discrimination", "discriminate"]
