"""Errors of a controller or of the way to it: exit code 1, for the input may be right."""

from __future__ import annotations

from robots.common.errors import OedError


class LinkError(OedError):
    """The controller cannot be reached, is silent, or speaks another protocol."""


class ControllerError(OedError):
    """The controller answers, but does not do what it was asked: a refusal, an error, a motion that does not end."""


class PointRefusedError(ControllerError):
    """The controller refuses a point; its state may say why."""
