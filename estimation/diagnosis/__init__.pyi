"""What a model gets wrong, why, and what mending it brings."""

from estimation.diagnosis.pipeline import diagnose as diagnose
from estimation.diagnosis.results.diagnosis import Diagnosis as Diagnosis
from estimation.diagnosis.results.diagnosis import Finding as Finding
