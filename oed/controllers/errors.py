"""Errors of a controller or of the way to it: exit code 1 where the input may be right."""

from __future__ import annotations

from robots.common.errors import InputError, OedError


class LinkError(OedError):
    """The controller cannot be reached, is silent, or speaks another protocol."""


class ProtocolError(LinkError):
    """What answers at the given address is no simple_message controller, or uses another format."""

    exit_code = InputError.exit_code


class ControllerError(OedError):
    """The controller answers, but does not do what it was asked: a refusal, an error, a motion that does not end."""


class PointRefusedError(ControllerError):
    """The controller refuses a point; its state may say why."""


class NoReplyError(LinkError):
    """A point is not answered; whether the controller lives, its feedback says."""


class RecordingError(InputError):
    """The log takes no more rows: the disk is full, or gone."""
