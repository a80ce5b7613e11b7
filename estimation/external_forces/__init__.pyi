"""External forces from the drives' torques: observer, contacts, and the link that was touched."""

from estimation.external_forces.contacts import Contact as Contact
from estimation.external_forces.force_estimation import estimate_forces as estimate_forces
from estimation.external_forces.localisation import Place as Place
from estimation.external_forces.online.streaming import ForceObserver as ForceObserver
from estimation.external_forces.online.streaming import Reading as Reading
from estimation.external_forces.options import ForceOptions as ForceOptions
from estimation.external_forces.result import ForceEstimate as ForceEstimate
from estimation.external_forces.thresholds.calibrations import Calibration as Calibration
