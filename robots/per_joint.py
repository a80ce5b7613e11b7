"""Values of a robot's file, one a joint, placed on the joints of a chain."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from robots.common.arrays import Array
from robots.common.errors import InputError
from robots.description import UNITS, Same
from robots.geometry.chain import Chain


@dataclass(frozen=True)
class PerJoint:
    """Places a file's lists, one entry a joint of its own choice, on the joints of the chain in use.

    Args:
        file: for messages.
        chain: the chain in use.
        names: of the joints that the lists are for, in their order.
    """

    file: str
    chain: Chain
    names: tuple[str, ...]

    def place(self, values: Sequence[float], key: str, default: ArrayLike, scale: Array | float = 1.0) -> Array:
        """Gives the value of each joint in use, (n,).

        Args:
            values: one per joint of the file's choice, or one for all (`Same`).
            key: of the file, for messages.
            default: of joints that the file does not choose.
            scale: factors to SI units, one per value.

        Raises:
            InputError: another number of values.
        """
        n = len(self.names)
        if isinstance(values, Same):
            values = [*values] * n
        if len(values) != n:
            raise InputError(f"{len(values)} values", file=self.file, column=key, allowed=f"{n}, one per joint")
        stated = dict(zip(self.names, np.asarray(values, dtype=np.float64) * scale, strict=True))
        fallback = np.broadcast_to(np.asarray(default, dtype=np.float64), (self.chain.n,))
        return np.array([stated.get(name, fallback[i]) for i, name in enumerate(self.chain.names)])

    def scale(self, unit: str | list[str], key: str, quantity: str) -> Array:
        """Gives the factors to SI units, one per joint of the file's choice.

        Args:
            unit: for all joints, or one each.
            key: of the file, for messages.
            quantity: that the unit must measure.

        Raises:
            InputError: another number of units, or one that does not suit the joint.
        """
        n = len(self.names)
        units = [unit] * n if isinstance(unit, str) else unit
        if len(units) != n:
            raise InputError(f"{len(units)} units", file=self.file, column=key, allowed=f"one, or {n}")
        kinds = dict(zip(self.chain.names, self.chain.kinds, strict=True))
        factors = []
        for i, (name, text) in enumerate(zip(self.names, units, strict=True)):
            kind = kinds.get(name)
            suitable = [u for u, (_, k, q) in UNITS.items() if q == quantity and kind in (k, None)]
            if text not in suitable:
                problem, allowed = f"the unit {text!r} of a {quantity}", ", ".join(suitable)
                raise InputError(problem, file=self.file, column=key, joint=i + 1, allowed=allowed)
            factors.append(UNITS[text][0])
        return np.array(factors)
