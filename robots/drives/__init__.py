"""Drives: the chain from a position command to the torque at a joint, and robots simulated in their closed loop."""

from __future__ import annotations

from robots.drives.backlash import Backlash
from robots.drives.base import DriveParameter, Instant, Member
from robots.drives.branches import load_branches
from robots.drives.delay import Delay, HeldCommand
from robots.drives.described import DescribedDrives, described_drives
from robots.drives.drive import Drive
from robots.drives.dynamics import DriveDynamics
from robots.drives.elastic_gear import ElasticGear
from robots.drives.gear import Armature, EndStop, Friction, LoadFriction, Offset, PositionFriction, StribeckFriction
from robots.drives.laws import LAWS, CascadeLaw, PdLaw, ServoLaw, VelocityLaw
from robots.drives.motor import MotorLimit
from robots.drives.simulation import Simulated, Situation, Start, simulate_drives

__all__ = [
    "Armature",
    "Backlash",
    "CascadeLaw",
    "Delay",
    "DescribedDrives",
    "Drive",
    "DriveDynamics",
    "DriveParameter",
    "ElasticGear",
    "EndStop",
    "Friction",
    "HeldCommand",
    "Instant",
    "LAWS",
    "LoadFriction",
    "Member",
    "MotorLimit",
    "Offset",
    "PdLaw",
    "PositionFriction",
    "ServoLaw",
    "Simulated",
    "Situation",
    "Start",
    "StribeckFriction",
    "VelocityLaw",
    "described_drives",
    "load_branches",
    "simulate_drives",
]
