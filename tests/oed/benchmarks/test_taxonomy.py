"""The names that answers may use."""

from __future__ import annotations

from oed.benchmarks.taxonomy import CLASSES, EFFECT_NAMES, PARAMETERS, UNKNOWN, class_of
from oed.benchmarks.truth.effects import KNOWN, UNLISTED
from robots.terms.effects import EFFECTS


def test_every_effect_has_a_class():
    """Every effect of the catalogue, and every one that the plant hides, is in exactly one class."""
    listed = [name for group in CLASSES.values() for name in group.effects]
    assert len(listed) == len(set(listed))
    assert set(listed) == set(EFFECTS)
    assert {effect.name for effect in KNOWN} <= set(listed)


def test_effects_outside_have_none():
    """What the plant hides beyond the catalogue has no class, as an effect without a name."""
    assert {class_of(effect.name) for effect in UNLISTED} == {class_of("outside")} == {UNKNOWN}


def test_classes_are_names_too():
    """A class is accepted as an answer, and is its own class."""
    assert all(class_of(kind) == kind for kind in CLASSES)
    assert set(CLASSES) < set(EFFECT_NAMES)


def test_parameters_belong_to_effects():
    """Each parameter belongs to exact names."""
    assert all(name in EFFECTS for parameter in PARAMETERS.values() for name in parameter.effects)
