"""Campaigns: stages that are repeated on one clock, and the virtual robot that plays them."""

from oed.campaigns.building import campaign
from oed.campaigns.heat import Temperatures, expected_temperatures, friction_power
from oed.campaigns.playing import play, record
from oed.campaigns.programme import Programme
from oed.campaigns.result import Campaign
from oed.campaigns.stages import Stage
from oed.campaigns.timetable import Slot

__all__ = [
    "Campaign",
    "Programme",
    "Slot",
    "Stage",
    "Temperatures",
    "campaign",
    "expected_temperatures",
    "friction_power",
    "play",
    "record",
]
