"""Thermal friction models fitted to logs."""

from estimation.thermal.campaign_fit import fit_campaign
from estimation.thermal.history import start_temperatures
from estimation.thermal.model_choice import choose_thermal, predict_run
from estimation.thermal.results.campaign_estimate import CampaignEstimate
from estimation.thermal.results.choice import ThermalChoice
from estimation.thermal.results.derived import Quantity
from estimation.thermal.results.estimate import RunFit, ThermalEstimate, load_thermal_model
from estimation.thermal.runs.extraction import friction_signal, thermal_runs
from estimation.thermal.runs.single_axis import SingleAxis, Sweep, fit_single_axis, sweep_friction
from estimation.thermal.runs.thermal_run import ThermalRun
from estimation.thermal.thermal_fit import fit_thermal
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
