"""Payloads: mass, centre of mass and inertia of what a robot carries, from logs."""

from estimation.payloads.body import Body, read_body
from estimation.payloads.identification import identify_payload
from estimation.payloads.intervals import Quantity
from estimation.payloads.result import PayloadEstimate, load_payload

__all__ = ["Body", "PayloadEstimate", "Quantity", "identify_payload", "load_payload", "read_body"]
