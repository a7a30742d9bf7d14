"""Estimates of two unknowns a source, made by hand, and a tracker that reports them."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from arrivals.trackers import (
    DirectionEstimate,
    DirectionTracker,
    RangeEstimate,
    Run,
    SphereEstimate,
)
from arrivals.trackers.run import RunRecorder
from arrivals.typing import Float


def _shared(doa_deg: Float, label: ArrayLike | None, std_deg: float) -> dict[str, Any]:
    n = len(doa_deg)
    return {
        "doa": np.deg2rad(doa_deg),
        "std": np.full(n, np.deg2rad(std_deg)),
        "existence": np.full(n, 0.9),
        "amplitude": np.full(n, 10.0 + 0j),
        "label": np.arange(n) if label is None else np.asarray(label, dtype=np.int64),
    }


def sphere_estimate(
    azimuth_deg: ArrayLike, elevation_deg: ArrayLike, label: ArrayLike | None = None,
    std_deg: float = 1.0,
) -> SphereEstimate:  # fmt: skip
    """Return directions of equal deviations along and across their circles of elevation."""
    azimuth, elevation = np.atleast_1d(azimuth_deg, elevation_deg)
    covariance = np.tile(np.deg2rad(std_deg) ** 2 * np.eye(2), (len(azimuth), 1, 1))
    return SphereEstimate(
        **_shared(azimuth, label, std_deg), elevation=np.deg2rad(elevation), covariance=covariance
    )


def range_estimate(
    doa_deg: ArrayLike, distance: ArrayLike, label: ArrayLike | None = None,
    std_deg: float = 1.0, relative_std: float = 0.1,
) -> RangeEstimate:  # fmt: skip
    """Return directions with ranges, m, infinite for plane waves."""
    doa, distance = np.atleast_1d(doa_deg), np.atleast_1d(distance).astype(float)
    plane = np.isinf(distance)
    std = np.where(plane, np.nan, relative_std * np.where(plane, 1.0, distance))
    curvature = np.where(plane, 0.0, relative_std / distance) ** 2
    covariance = np.zeros((len(doa), 2, 2))
    covariance[:, 0, 0], covariance[:, 1, 1] = np.deg2rad(std_deg) ** 2, curvature
    return RangeEstimate(
        **_shared(doa, label, std_deg), range=distance, range_std=std, covariance=covariance
    )


def run_of(estimates: Sequence[DirectionEstimate], kind: type[DirectionEstimate]) -> Run:
    """Return the run of a tracker with these estimates."""
    recorder = RunRecorder(kind)
    for estimate in estimates:
        recorder.add(estimate, np.zeros(1))
    return recorder.run(dt=1.0, elapsed=0.0)


class GivenEstimates(DirectionTracker):
    """Reports given estimates; a measurement is the number of one."""

    n_slots = 3

    def __init__(self, *estimates: DirectionEstimate, kind: type[DirectionEstimate]) -> None:
        self.estimates, self.estimate_kind = estimates, kind
        self.reset()

    def predict(self, u: ArrayLike | None = None, *, dt: float = 1.0) -> None:
        self.reset()

    def update(self, z: Any) -> None:
        self.report_estimate(self.estimates[int(np.real(z))])
