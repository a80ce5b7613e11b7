"""Campaigns: stages that are repeated on one clock, and the virtual robot that plays them."""

from oed.campaigns.building import campaign as campaign
from oed.campaigns.heat import Temperatures as Temperatures
from oed.campaigns.heat import expected_temperatures as expected_temperatures
from oed.campaigns.heat import friction_power as friction_power
from oed.campaigns.playing import play as play
from oed.campaigns.playing import record as record
from oed.campaigns.programme import Programme as Programme
from oed.campaigns.result import Campaign as Campaign
from oed.campaigns.stages import Stage as Stage
from oed.campaigns.timetable import Slot as Slot
