"""Fleets: many robots of one type, a row each, by processes, resumed after a kill."""

from estimation.monitoring.fleets.fleet import monitor_fleet
from estimation.monitoring.fleets.members import Member, find_members
from estimation.monitoring.fleets.result import FleetResult
from estimation.monitoring.fleets.robot_row import RobotRow, Trend

__all__ = ["FleetResult", "Member", "RobotRow", "Trend", "find_members", "monitor_fleet"]
