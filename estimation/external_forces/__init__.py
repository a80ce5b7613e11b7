"""External forces from the drives' torques: observer, contacts, and the link that was touched."""

from estimation.external_forces.contacts import Contact
from estimation.external_forces.force_estimation import estimate_forces
from estimation.external_forces.localisation import Place
from estimation.external_forces.online.streaming import ForceObserver, Reading
from estimation.external_forces.result import ForceEstimate
from estimation.external_forces.thresholds.calibrations import Calibration

__all__ = ["Calibration", "Contact", "ForceEstimate", "ForceObserver", "Place", "Reading", "estimate_forces"]
