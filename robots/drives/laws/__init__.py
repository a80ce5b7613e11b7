"""Control laws of drives: what torque follows from a command, one law a file."""

from __future__ import annotations

from robots.drives.laws.cascade import CascadeLaw
from robots.drives.laws.pd import PdLaw
from robots.drives.laws.servo import ServoLaw
from robots.drives.laws.velocity import VelocityLaw

LAWS = {law.name: law for law in (PdLaw, ServoLaw, VelocityLaw, CascadeLaw)}
"""The control laws by name."""

__all__ = ["LAWS", "CascadeLaw", "PdLaw", "ServoLaw", "VelocityLaw"]
