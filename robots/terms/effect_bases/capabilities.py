"""Capabilities of effects: what a diagnosis must know in addition to their columns."""

from __future__ import annotations

from enum import Enum


class Persistence(Enum):
    """Whether the same motion always shows an effect.

    Attributes:
        STATE: it depends on the motion alone.
        TIME: it starts, ends or builds up at some time.
        TRANSIENT: it belongs to the logs in which it was found, and may be absent or different in others.
        HEAT: it builds up, and the motion before a log still acts in it through heat.
    """

    STATE = "state"
    TIME = "time"
    TRANSIENT = "transient"
    HEAT = "heat"


class AtReversals(Enum):
    """What an effect does at velocity reversals, where the motion is known least.

    Attributes:
        NOTHING: nothing special.
        GRADUAL: friction changes sign gradually; an error in the reversal's time resembles it.
        IMPACT: it follows changes of acceleration, which are largest there.
        LATE: all torque, or a joint's, is logged late, and friction changes sign late. Its coefficient is a time, which
            reversals determine only as well as their own times are known. The sharpness of the friction sign is fitted
            together with it. Joints must agree on the time if it acts on the whole robot.
    """

    NOTHING = "nothing"
    GRADUAL = "gradual"
    IMPACT = "impact"
    LATE = "late"


class GearLoad(Enum):
    """How an effect and the load of the gears depend on each other.

    Attributes:
        NONE: not at all.
        CAUSES: its torque loads the gears.
        PRELOADS: the same, and its constant part is in the base model's offset.
        FEELS: it depends on the load of the gears.
    """

    NONE = "none"
    CAUSES = "causes"
    PRELOADS = "preloads"
    FEELS = "feels"


class Reading(Enum):
    """Whether an effect changes how torque is read instead of adding to it.

    Attributes:
        ADDS: it adds to the torque.
        CUTS: it acts on the total torque, including other effects (`Situation.beyond`).
        DISTORTS: it distorts the reading of its joint as a function of the torque. The base model follows such
            readings, so both are fitted together. A `StaticJointEffect`.
    """

    ADDS = "adds"
    CUTS = "cuts"
    DISTORTS = "distorts"


class AboveBand(Enum):
    """Whether an effect is searched above the frequencies at which accelerations are known.

    Attributes:
        NO: its torque depends on accelerations.
        COUNTS: it does not.
        EXOGENOUS: it causes the motion instead of depending on it, so no base model is fitted to these data.
    """

    NO = "no"
    COUNTS = "counts"
    EXOGENOUS = "exogenous"
