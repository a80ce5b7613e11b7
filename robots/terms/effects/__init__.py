"""Effects beyond the base model, one per file, for the plant, the diagnosis and extended models."""

from __future__ import annotations

from typing import Any

from robots.common.registry import Registry
from robots.terms.effect_bases.base import Coefficient, Effect, JointEffect, Shape, Situation
from robots.terms.effect_bases.check import check_definition, check_effect
from robots.terms.effect_bases.experiments import EXPERIMENTS
from robots.terms.effect_bases.static import StaticEffect, StaticJointEffect
from robots.terms.effects.asymmetric_friction import AsymmetricFriction
from robots.terms.effects.backlash import Backlash
from robots.terms.effects.base_compliance import BaseCompliance
from robots.terms.effects.base_tilt import BaseTilt
from robots.terms.effects.current_clipping import CurrentClipping
from robots.terms.effects.current_lag import CurrentLag
from robots.terms.effects.encoder_eccentricity import EncoderEccentricity
from robots.terms.effects.encoder_offset import EncoderOffset
from robots.terms.effects.external_contact import ExternalContact
from robots.terms.effects.friction_step import FrictionStep
from robots.terms.effects.hand_guiding import HandGuiding
from robots.terms.effects.joint_coupling import JointCoupling
from robots.terms.effects.joint_elasticity import JointElasticity
from robots.terms.effects.load_dependent_friction import LoadDependentFriction
from robots.terms.effects.load_heat import LoadHeat
from robots.terms.effects.load_stribeck import LoadStribeck
from robots.terms.effects.payload_change import PayloadChange
from robots.terms.effects.position_dependent_friction import PositionDependentFriction
from robots.terms.effects.presliding_hysteresis import PreslidingHysteresis
from robots.terms.effects.shear_thinning import ShearThinning
from robots.terms.effects.spring import Spring
from robots.terms.effects.stribeck import Stribeck
from robots.terms.effects.thermal_friction import ThermalFriction
from robots.terms.effects.time_delay import TimeDelay
from robots.terms.effects.torque_constant_error import TorqueConstantError
from robots.terms.effects.torque_constant_heat import TorqueConstantHeat
from robots.terms.effects.torque_constant_saturation import TorqueConstantSaturation
from robots.terms.effects.torque_crosstalk import TorqueCrosstalk
from robots.terms.effects.torque_ripple import TorqueRipple
from robots.terms.effects.torque_sensor_drift import TorqueSensorDrift
from robots.terms.situations.situation import situation

# A new effect needs one file, and one line here.
_ALL: tuple[Effect, ...] = (
    ThermalFriction(),
    FrictionStep(),
    Stribeck(),
    PreslidingHysteresis(),
    AsymmetricFriction(),
    LoadDependentFriction(),
    PositionDependentFriction(),
    TorqueRipple(),
    Backlash(),
    JointElasticity(),
    BaseCompliance(),
    JointCoupling(),
    Spring(),
    TorqueConstantError(),
    TorqueConstantSaturation(),
    CurrentClipping(),
    TorqueSensorDrift(),
    TimeDelay(),
    EncoderOffset(),
    PayloadChange(),
    BaseTilt(),
    ExternalContact(),
    HandGuiding(),
    CurrentLag(),
    ShearThinning(),
    LoadStribeck(),
    EncoderEccentricity(),
    TorqueCrosstalk(),
    TorqueConstantHeat(),
    LoadHeat(),
)


def _instance(effect: Any) -> Effect:
    made: Effect = effect() if isinstance(effect, type) else effect
    return made


EFFECTS: Registry[Effect] = Registry(
    "effect",
    "robot_oed.effects",
    _ALL,
    check=check_definition,
    adapt=_instance,
)

__all__ = [
    "EFFECTS",
    "EXPERIMENTS",
    "Coefficient",
    "Effect",
    "JointEffect",
    "Shape",
    "Situation",
    "StaticEffect",
    "StaticJointEffect",
    "check_effect",
    "situation",
]
