"""How the robot was set up for a log, where that is known: what it carried, and how its base stood."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike

from robots.common.arrays import Array
from robots.common.errors import InputError
from robots.regressor import TorqueModel
from robots.robot import Robot
from robots.signals import Log, Motion
from robots.terms import RigidBody
from robots.terms.situations.flange_body import carrying, require_flange
from robots.terms.situations.sensitivities import moved_body

HEAT = "a thermal model"
"""Models without payloads and gravity vectors, for `require_plain`."""


@dataclass(frozen=True, eq=False)
class Load:
    """A known payload.

    Attributes:
        model: the rigid body, under the log's gravity.
        parameters: ten inertial parameters about the last link's frame.
    """

    model: TorqueModel
    parameters: Array

    def torque(self, motion: Motion) -> Array:
        """Evaluates the payload's torque (N, n) [N m or N]."""
        last = range(self.model.size - 10, self.model.size)
        return self.model.torque(motion.q, motion.dq, motion.ddq, self.parameters, columns=last)


def load_of(robot: Robot, log: Log) -> Load | None:
    """Gives a log's payload; None without."""
    if log.payload is None or not log.payload.any():
        return None
    require_flange(robot)
    return Load(_rigid_body(robot.under(log.gravity)), moved_body(robot.chain.tip) @ log.payload)


# The model keeps its compiled functions.
@lru_cache(maxsize=16)
def _rigid_body(robot: Robot) -> TorqueModel:
    return TorqueModel(robot, (RigidBody(),))


def robot_for_log(robot: Robot, log: Log) -> Robot:
    """Gives the robot as it was for a log: on its base, the payload a part of the last link."""
    return carrying(robot.under(log.gravity), log.payload)


def gravities_of(logs: Sequence[Log]) -> list[Array]:
    """Lists the gravities (3,) that logs state [m/s2]."""
    return [log.gravity for log in logs if log.gravity is not None]


def require_plain(logs: Sequence[Log], what: str) -> None:
    """Refuses logs that state a payload or a gravity where neither can be counted in.

    Args:
        logs: some.
        what: does not know them, as in ``the method iv``.

    Raises:
        InputError: naming the log.
    """
    for log in logs:
        stated = "gravity" if log.gravity is not None else "payload" if log.payload is not None else None
        if stated is not None:
            raise InputError(
                f"the log states a {stated}, which {what} cannot use",
                file=log.metadata.get("file", log.name or None),
                column=stated,
                allowed="logs without payload and with the base orientation of the robot's description",
            )


def require_known(model: TorqueModel, columns: Sequence[int], known: Sequence[ArrayLike], gravity: ArrayLike) -> None:
    """Refuses a gravity under which base parameters do not say the torque.

    Args:
        model: the torque model.
        columns: those that carry a base parameter.
        known: gravities (3,) under which they were found, besides the description's.
        gravity: another (3,) [m/s2].

    Raises:
        InputError: naming parameters that the gravity needs in addition.
    """
    from robots.base_parameters import find_base_parameters

    if model.robot.under(gravity) is model.robot or any(np.array_equal(gravity, other) for other in known):
        return
    asked = find_base_parameters(model, gravities=[*known, gravity])
    missing = [name for name, i in zip(asked.names, asked.independent, strict=True) if i not in set(columns)]
    if missing:
        some = ", ".join(missing[:3]) + (", ..." if len(missing) > 3 else "")
        raise InputError(
            (
                f"with gravity {np.array2string(np.asarray(gravity, dtype=float), precision=3)} these parameters "
                f"matter, but the model's logs did not determine them: {some}"
            ),
            column="gravity",
            remedy="identify the model again with an additional log recorded under this gravity",
        )
