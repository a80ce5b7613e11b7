"""Profiles of driver programs: one file a driver."""

from __future__ import annotations

from oed.controllers.drivers.abb import ABB
from oed.controllers.drivers.base import Driver
from oed.controllers.drivers.efort import EFORT
from oed.controllers.drivers.egm import EGM
from oed.controllers.drivers.fanuc import FANUC
from oed.controllers.drivers.generic import GENERIC
from oed.controllers.drivers.motoman import MOTOMAN
from oed.controllers.drivers.ur import UR
from robots.common.errors import InputError

DRIVERS = {driver.name: driver for driver in (EFORT, FANUC, MOTOMAN, ABB, EGM, UR, GENERIC)}

__all__ = ["DRIVERS", "Driver", "driver_of"]


def driver_of(name: str) -> Driver:
    """Finds a profile by its name.

    Raises:
        InputError: an unknown name.
    """
    if name not in DRIVERS:
        raise InputError(f"the driver {name!r} is not known", allowed=", ".join(DRIVERS))
    return DRIVERS[name]
