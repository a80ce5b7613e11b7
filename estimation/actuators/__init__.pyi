"""Drives identified from commands and positions, without a torque signal."""

from estimation.actuators.identification import identify_actuators as identify_actuators
from estimation.actuators.in_the_loop import LoopDiagnosis as LoopDiagnosis
from estimation.actuators.in_the_loop import loop_diagnosis as loop_diagnosis
from estimation.actuators.options import ActuatorOptions as ActuatorOptions
from estimation.actuators.options import FitOptions as FitOptions
from estimation.actuators.result import Actuators as Actuators
from estimation.actuators.result import DriveValue as DriveValue
from estimation.actuators.result import MotionError as MotionError
from estimation.actuators.result import load_actuators as load_actuators
from estimation.actuators.search import LoopFinding as LoopFinding
