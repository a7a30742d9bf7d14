"""Scenes of the comparison, by name."""

from __future__ import annotations

import numpy as np

from arrivals.scenarios.simulations.stations import StationsGhost, StationsRadio, StationsSound
from arrivals.scenarios.simulations.stations.base import StationsScenario

ONE_DEGREE = float(np.deg2rad(1.0))
CELLS: dict[str, StationsScenario] = {
    "radio_0db": StationsRadio(snr_db=0),
    "radio_5db": StationsRadio(snr_db=5),
    "radio_10db": StationsRadio(),
    "radio_20db": StationsRadio(snr_db=20),
    "radio3_10db": StationsRadio(n_stations=3),
    "radio3_20db": StationsRadio(n_stations=3, snr_db=20),
    "sound_0db": StationsSound(snr_db=0),
    "sound_10db": StationsSound(),
    "sound_20db": StationsSound(snr_db=20),
    "missing": StationsRadio(n_missing=1),
    "missing3": StationsRadio(n_stations=3, n_missing=1),
    "heading": StationsRadio(heading_std=ONE_DEGREE),
    "position": StationsRadio(position_std=10.0),
    "ghost_10db": StationsGhost(),
    "ghost_20db": StationsGhost(snr_db=20),
    "ghost4_10db": StationsGhost(n_stations=4),
    "one_source": StationsRadio(n_sources=1),
    "two_sources": StationsRadio(n_sources=2),
    "corners": StationsRadio(spread=1.0),
    "close": StationsRadio(separation=0.0),
    "two_stations_20db": StationsRadio(n_stations=2, n_sources=2, snr_db=20),
    "two_stations": StationsRadio(n_stations=2, n_sources=2),
    "two_stations_rss": StationsRadio(n_stations=2, n_sources=2, n_rss_sensors=8),
    "one_station_rss": StationsRadio(n_stations=1, n_sources=1, n_rss_sensors=8),
    "radio3_rss": StationsRadio(n_stations=3, n_rss_sensors=8),
}
