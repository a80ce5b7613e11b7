"""Motions that determine drives without a torque signal."""

from __future__ import annotations

from oed.experiments.drive_options import DriveDesignOptions
from oed.experiments.drives.designing import design_drive_motion
from oed.experiments.drives.result import DriveDesign, ExpectedError

__all__ = ["DriveDesign", "DriveDesignOptions", "ExpectedError", "design_drive_motion"]
