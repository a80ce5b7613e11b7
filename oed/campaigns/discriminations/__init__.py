"""Experiments that distinguish two possible causes."""

from oed.campaigns.discrimination_options import DiscriminationOptions
from oed.campaigns.discriminations.design import discriminate
from oed.campaigns.discriminations.discrimination import Discrimination

__all__ = ["Discrimination", "DiscriminationOptions", "discriminate"]
