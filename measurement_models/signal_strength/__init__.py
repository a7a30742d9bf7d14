"""Received signal strength: path loss, envelope statistics, log-normal readings."""

from arrivals.measurement_models.signal_strength.decibels import (
    db_to_neper,
    dbm_to_neper,
    neper_to_db,
    neper_to_dbm,
    watt_to_neper,
)
from arrivals.measurement_models.signal_strength.envelope import AveragedEnvelope
from arrivals.measurement_models.signal_strength.gains import LogGains
from arrivals.measurement_models.signal_strength.log_normal import LogNormalRSS
from arrivals.measurement_models.signal_strength.path_loss import Levels, PropagationModel

__all__ = [
    "LogNormalRSS",
    "AveragedEnvelope",
    "LogGains",
    "PropagationModel",
    "Levels",
    "db_to_neper",
    "dbm_to_neper",
    "neper_to_db",
    "neper_to_dbm",
    "watt_to_neper",
]
