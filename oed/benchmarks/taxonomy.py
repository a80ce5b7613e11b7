"""Names of effects that an answer may use: coarse classes for every tool, and the exact names of the catalogue."""

from __future__ import annotations

from dataclasses import dataclass
from types import MappingProxyType

UNKNOWN = "unknown"
"""The name of an effect that was found and not identified."""


@dataclass(frozen=True, kw_only=True)
class EffectClass:
    """A coarse class of effects.

    Attributes:
        meaning: what its effects have in common.
        effects: exact names in it.
    """

    meaning: str
    effects: tuple[str, ...]


@dataclass(frozen=True, kw_only=True)
class ParameterName:
    """A parameter whose true value is known.

    Attributes:
        unit: its unit.
        meaning: its definition.
        effects: exact names of the effects that have it.
    """

    unit: str
    meaning: str
    effects: tuple[str, ...]


CLASSES = MappingProxyType(
    {
        "friction": EffectClass(
            meaning="friction that depends on velocity, direction, load or position otherwise than the base model",
            effects=(
                "stribeck",
                "presliding_hysteresis",
                "asymmetric_friction",
                "load_dependent_friction",
                "position_dependent_friction",
                "shear_thinning",
                "load_stribeck",
            ),
        ),
        "friction_change": EffectClass(
            meaning="friction that changes with time or heat",
            effects=("friction_step", "thermal_friction", "load_heat"),
        ),
        "ripple": EffectClass(meaning="torque that is periodic per motor or gear turn", effects=("torque_ripple",)),
        "elasticity": EffectClass(
            meaning="a link that moves relative to its motor", effects=("joint_elasticity", "backlash")
        ),
        "coupling": EffectClass(
            meaning="torque of a joint that depends on another joint's drive",
            effects=("joint_coupling", "torque_crosstalk"),
        ),
        "spring": EffectClass(meaning="a spring, balancer or cable on a joint", effects=("spring",)),
        "torque_scale": EffectClass(
            meaning="logged torque that is not proportional to the true torque",
            effects=(
                "torque_constant_error",
                "torque_constant_saturation",
                "current_clipping",
                "torque_constant_heat",
            ),
        ),
        "offset": EffectClass(meaning="a torque zero that drifts", effects=("torque_sensor_drift",)),
        "encoder": EffectClass(
            meaning="a logged position that is wrong", effects=("encoder_offset", "encoder_eccentricity")
        ),
        "delay": EffectClass(meaning="a logged torque that is late", effects=("time_delay", "current_lag")),
        "payload": EffectClass(meaning="a payload that changes", effects=("payload_change",)),
        "base": EffectClass(meaning="a base that is tilted or yields", effects=("base_tilt", "base_compliance")),
        "contact": EffectClass(
            meaning="an external force of short duration", effects=("external_contact", "hand_guiding")
        ),
    }
)
"""Classes by name."""

PARAMETERS = MappingProxyType(
    {
        "stribeck_velocity": ParameterName(
            unit="rad/s", meaning="v_s of exp(-(|v|/v_s)^d) sign v", effects=("stribeck",)
        ),
        "presliding_distance": ParameterName(
            unit="rad", meaning="sigma of z' = v - |v| z / sigma, LuGre", effects=("presliding_hysteresis",)
        ),
        "driven_back": ParameterName(
            unit="1",
            meaning="losses while the load drives the joint, over those while the joint drives it",
            effects=("load_dependent_friction",),
        ),
        "time_constant": ParameterName(unit="s", meaning="of the heating of the gear", effects=("thermal_friction",)),
        "order": ParameterName(unit="1", meaning="periods per turn of the joint", effects=("torque_ripple",)),
        "delay": ParameterName(unit="s", meaning="of the torque behind the position", effects=("time_delay",)),
        "limit": ParameterName(unit="N m", meaning="largest logged torque", effects=("current_clipping",)),
        "change_time": ParameterName(
            unit="s", meaning="on the log's clock", effects=("friction_step", "payload_change")
        ),
        "mass": ParameterName(unit="kg", meaning="of the payload picked up", effects=("payload_change",)),
        "start": ParameterName(unit="s", meaning="on the log's clock", effects=("external_contact",)),
    }
)
"""Parameters that are scored, by name."""

_CLASS_OF = {name: kind for kind, group in CLASSES.items() for name in (*group.effects, kind)}
EFFECT_NAMES = (UNKNOWN, *dict.fromkeys([*CLASSES, *_CLASS_OF]))
"""All names that an answer may use."""


def class_of(name: str) -> str:
    """Returns the class of an exact name or of a class, and `UNKNOWN` for an effect without a name."""
    return _CLASS_OF.get(name, UNKNOWN)


def known_parameters(effect: str, values: dict[str, float]) -> dict[str, float]:
    """Selects the parameters of an effect that are scored.

    Args:
        effect: its exact name.
        values: values by name.
    """
    return {name: value for name, value in values.items() if name in PARAMETERS and effect in PARAMETERS[name].effects}
