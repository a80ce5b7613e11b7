"""Plays a campaign on a controller, stage by stage, and goes on after an interruption."""

from oed.campaigns.runs.result import CampaignRun
from oed.campaigns.runs.running import run_campaign

__all__ = ["CampaignRun", "run_campaign"]
