"""Thermal friction models fitted to logs."""

from estimation.thermal.campaign import fit_campaign
from estimation.thermal.campaign_estimate import CampaignEstimate
from estimation.thermal.choice import ThermalChoice
from estimation.thermal.choosing import choose_thermal, predict_run
from estimation.thermal.derived import Quantity
from estimation.thermal.estimate import RunFit, ThermalEstimate, load_thermal_model
from estimation.thermal.extraction import friction_signal, thermal_runs
from estimation.thermal.fitting import fit_thermal
from estimation.thermal.history import start_temperatures
from estimation.thermal.runs import ThermalRun
from estimation.thermal.single_axis import SingleAxis, Sweep, fit_single_axis, sweep_friction
from estimation.thermal.torque import ThermalTorqueModel, thermal_from_dict

__all__ = [
    "CampaignEstimate",
    "Quantity",
    "RunFit",
    "SingleAxis",
    "Sweep",
    "ThermalChoice",
    "ThermalEstimate",
    "ThermalRun",
    "ThermalTorqueModel",
    "choose_thermal",
    "fit_campaign",
    "fit_single_axis",
    "fit_thermal",
    "friction_signal",
    "load_thermal_model",
    "predict_run",
    "start_temperatures",
    "sweep_friction",
    "thermal_from_dict",
    "thermal_runs",
]
