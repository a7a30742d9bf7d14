"""Steps of runs for the live views."""

from typing import Any

import numpy as np

from arrivals.live.steps import LiveScene, LiveStep
from arrivals.trackers import DirectionEstimate, PositionEstimate, SphereEstimate

GRID = tuple(np.linspace(-90.0, 90.0, 91).tolist())
LINE = LiveScene("tow.wav: svalse", line=True, directions_deg=GRID)
CIRCLE = LiveScene("talk.wav: cbf")
SKY = LiveScene("sky.wav: svalse", "sky")
MAP = LiveScene("stations.toml: 2 stations", "map", stations=(("a", 0.0, 0.0), ("b", 9.0, 0.0)))


def directions(doa_deg: Any, label: Any, **more: Any) -> DirectionEstimate:
    """Return directions of 2 degrees standard deviation, existence 0.9 and 0 dB."""
    doa = np.deg2rad(np.atleast_1d(doa_deg).astype(float))
    one = np.ones(len(doa))
    return DirectionEstimate(
        doa,
        np.deg2rad(2.0) * one,
        0.9 * one,
        one.astype(np.complex128),
        np.atleast_1d(label),
        **more,
    )


def line_steps(n: int = 5) -> list[LiveStep]:
    """Return steps of a source that moves by 10 degrees a step from 0, with its beam power."""
    beam = [-np.abs(np.array(GRID) - 10.0 * k) / 10 for k in range(n)]
    return [
        LiveStep(
            k, 0.1 * k, directions(10.0 * k, 3), 0.2, 0.01, beam[k], np.array([-10.0, -np.inf])
        )
        for k in range(n)
    ]


def sky_step() -> LiveStep:
    """Return a source at azimuth 90 degrees and elevation 30 degrees."""
    one = np.ones(1)
    estimate = SphereEstimate(
        np.pi / 2 * one, 0.01 * one, one, one.astype(np.complex128), np.array([4]),
        elevation=np.pi / 6 * one, covariance=1e-4 * np.eye(2)[None],
    )  # fmt: skip
    return LiveStep(0, 0.0, estimate)


def map_steps() -> list[LiveStep]:
    """Return a source that moves along y, of 3 m and 1 m standard deviation, and a bearing."""
    one = np.ones(1)
    return [
        LiveStep(k, float(k), PositionEstimate(
            np.array([[5.0, float(k)]]), np.diag([9.0, 1.0])[None], 0 * one, np.nan * one,
            np.array([2]),
        ), rays=((0.0, 0.0, np.pi / 2),))
        for k in range(3)
    ]  # fmt: skip
