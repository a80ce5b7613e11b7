"""True effects that cases hide: those of the catalogue (`KNOWN`), and others (`UNLISTED`)."""

from __future__ import annotations

from oed.benchmarks.truth.effects.actuator import Clipping, Delay, Drift, EncoderOffset, Saturation, TorqueConstant
from oed.benchmarks.truth.effects.base import Effect
from oed.benchmarks.truth.effects.compliant_base import LeaningBase
from oed.benchmarks.truth.effects.friction import (
    Asymmetric,
    FrictionStep,
    LoadDependent,
    LuGre,
    PositionDependent,
    Stribeck,
    Warming,
)
from oed.benchmarks.truth.effects.surroundings import Contact, Payload, Tilt
from oed.benchmarks.truth.effects.transmission import Backlash, Balancer, Cable, Elastic, Ripple, WristCoupling
from oed.benchmarks.truth.effects.unlisted_joint_effects import (
    BeltFriction,
    BorrowedFriction,
    CrossWave,
    DeadZone,
    Drag,
    DraggingBrake,
    Interpolation,
    SlippedZero,
    TiredCable,
)
from oed.benchmarks.truth.effects.unlisted_robot_effects import Conveyor, FloorVibration, Hose, SlippedBase, Slosh

KNOWN: tuple[type[Effect], ...] = (
    Stribeck,
    LuGre,
    Asymmetric,
    LoadDependent,
    PositionDependent,
    FrictionStep,
    Warming,
    Ripple,
    Elastic,
    Backlash,
    WristCoupling,
    Balancer,
    Cable,
    TorqueConstant,
    Saturation,
    Clipping,
    Drift,
    Delay,
    EncoderOffset,
    Payload,
    Tilt,
    Contact,
    LeaningBase,
)
UNLISTED: tuple[type[Effect], ...] = (
    CrossWave,
    TiredCable,
    FloorVibration,
    Interpolation,
    Slosh,
    Hose,
    Drag,
    BorrowedFriction,
    DraggingBrake,
    BeltFriction,
    DeadZone,
    SlippedBase,
    SlippedZero,
    Conveyor,
)
__all__ = ["KNOWN", "UNLISTED", "Effect"]
