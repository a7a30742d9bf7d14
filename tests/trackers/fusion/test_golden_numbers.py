"""Births and updates of `fused` give the golden numbers of its specification."""

import numpy as np
import pytest

from arrivals.measurement_models import ArraySnapshot, LogNormalRSS, SensorArray, Station
from arrivals.motion_models import ConstantVelocity
from arrivals.trackers import AmplitudePrior, BearingDetection, Fused, GlobalHypotheses, bearings
from arrivals.trackers.fusion.births.crossings import crossing
from arrivals.trackers.fusion.signal_strength import ValidReadings, update_by_levels
from arrivals.trackers.fusion.state_layout import StateLayout
from arrivals.trackers.fusion.tracks import Tracks
from arrivals.typing import Float

PLACES = np.array([[0.0, 0.0], [1000.0, 0.0], [500.0, 900.0]])
SOURCE = np.array([400.0, 300.0])
AZIMUTHS = np.arctan2(*(SOURCE - PLACES).T[::-1]) + np.deg2rad([0.5, -0.3, 0.2])
VARIANCE = (1.3 * np.deg2rad(1.0)) ** 2
MOTION = ConstantVelocity(q=0.05)
STEP = [([azimuth], [VARIANCE]) for azimuth in AZIMUTHS]


def tracker(heading_std: float = 0.0) -> Fused:
    stations = [Station(None, place, heading_std=heading_std) for place in PLACES]
    return Fused(
        MOTION,
        stations,
        area=(0.0, 0.0, 1000.0, 1000.0),
        speed_std=8.0,
        hypotheses=GlobalHypotheses(challenge=0),
    )


def tracks(fused: Fused) -> Tracks:
    return fused.bank.hypotheses[0].tracks


def std(P: Float) -> Float:
    return np.sqrt(np.diagonal(P, axis1=-2, axis2=-1))


def test_birth_from_three_bearings_golden_4() -> None:
    fused = tracker()
    fused.predict()
    fused.update(STEP)
    born = tracks(fused)
    assert born.existence == pytest.approx([0.99])
    assert std(born.P)[0] == pytest.approx([11.217754, 8, 11.531585, 8], rel=1e-6)
    assert born.x[0] == pytest.approx([401.320711, 0, 304.989141, 0], rel=1e-7)
    assert fused.bank.hypotheses[0].evidence == pytest.approx(11.78239249935614, rel=1e-8)


def test_update_with_a_bearing_a_missing_and_an_empty_station_golden_5() -> None:
    fused = tracker()
    fused.predict()
    fused.update(STEP)
    fused.predict()
    fused.update_bearings([([AZIMUTHS[0] + np.deg2rad(1.0)], [VARIANCE]), None, ([], [])])
    after = tracks(fused)
    assert after.existence == pytest.approx([0.9989244496510475], rel=1e-8)
    assert after.x[0] == pytest.approx([398.462483, -1.359493, 309.601742, 1.788892], rel=1e-6)
    assert std(after.P)[0] == pytest.approx([12.906341, 7.667008, 11.677428, 7.411503], rel=1e-6)
    assert fused.bank.hypotheses[0].evidence == pytest.approx(2.9178872486397682, rel=1e-8)


def test_update_by_signal_strength_golden_6() -> None:
    sensors = np.array([[200.0, 200], [600, 200], [200, 600], [600, 600]])
    rss = LogNormalRSS(sensors, 0.46, alpha=3.0, log_noise=-10.36, r_min=10.0)
    stations = [Station(None, place) for place in PLACES]
    layout = StateLayout.of(MOTION, stations, 8.0, AmplitudePrior(mean=0.0, variance=0.345**2))
    before = Tracks.empty(5, 3, 1, 1)._replace(
        x=np.array([[[400.0, 0, 300, 0, 0]]]),
        P=np.diag([900.0, 64, 900, 64, 0.345**2])[None, None],
        existence=np.array([[0.9]]),
    )
    xi = np.array([-8.0, -8.3, -8.9, -9.2])
    after, evidence = update_by_levels(
        before, ValidReadings(xi, rss.variance, rss.propagation), layout
    )
    assert after.x[0, 0] == pytest.approx([392.255867, 0, 295.222853, 0, -0.097115], rel=1e-5)
    assert std(after.P)[0, 0] == pytest.approx([25.908266, 8, 27.762367, 8, 0.195131], rel=1e-5)
    assert after.existence[0] == pytest.approx([0.9944985370383037], rel=1e-8)
    assert evidence == pytest.approx([2.0001923037691265], rel=1e-8)


def test_birth_with_unknown_headings_golden_8() -> None:
    fused = tracker(heading_std=np.deg2rad(1.0))
    fused.predict()
    fused.update(STEP)
    born = tracks(fused)
    assert std(born.P)[0, :4] == pytest.approx([14.181465, 8, 14.488526, 8], rel=1e-6)
    headings = np.rad2deg(born.x[0, [4, 7, 10]])
    assert headings == pytest.approx([-0.050614, -0.048817, -0.057228], abs=1e-6)
    assert np.rad2deg(std(born.P)[0, [4, 7, 10]]) == pytest.approx(
        [0.939949, 0.944228, 0.922674], abs=1e-6
    )


@pytest.mark.parametrize("inflation", [1.0, 1.3])
def test_bearings_of_snapshots_have_inflated_variances(inflation: float) -> None:
    """With three bearings of one source the start has the covariance of their crossing."""
    model = ArraySnapshot(SensorArray.uca(8, 0.65), 1.0, noise=0.01)
    stations = [Station(model, place) for place in PLACES]
    azimuth = np.arctan2(*(SOURCE - PLACES).T[::-1])
    z = [model.simulate([each], [1.0], np.random.default_rng(2)) for each in azimuth]
    fused = Fused(MOTION, stations, detection=BearingDetection(inflation=inflation))
    fused.predict()
    fused.update(z)
    found = [bearings(model, one, [each]) for one, each in zip(z, azimuth, strict=True)]
    variance = [inflation**2 * R[0, 0] for _, R, _ in found]
    _, C, _ = crossing(PLACES, [doa[0] for doa, _, _ in found], variance)
    assert tracks(fused).P[0][::2, ::2] == pytest.approx(C, rel=0.05)
