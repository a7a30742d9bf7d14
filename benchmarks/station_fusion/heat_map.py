"""Peaks of a map of summed beam spectra, their number given."""

from __future__ import annotations

import numpy as np

from arrivals.scenarios.simulations.stations import StationsTrial
from arrivals.trackers import PositionEstimate
from arrivals.typing import Complex, Float
from station_fusion.intersections import positions

CELL = 0.01  # of the size
LOADING = 0.01  # of the mean power, in the covariance
CLEARED = 0.06  # of the size, around a peak


class HeatMap:
    """Sum over stations of MVDR spectra, of beam spectra below 8 snapshots, on a 1 % grid."""

    def __init__(self, trial: StationsTrial) -> None:
        self.trial, model = trial, trial.measurement
        x0, y0, _, _ = trial.area
        axis = (np.arange(round(1 / CELL)) + 0.5) * CELL * trial.size
        self.points = np.stack(np.meshgrid(x0 + axis, y0 + axis, indexing="ij"), -1).reshape(-1, 2)
        grid = np.deg2rad(np.arange(360))
        a = model.steering_vector(grid).reshape(360, model.n_bins, -1)
        self.a = np.moveaxis(a, 1, 0)  # (F, 360, M)
        d = [self.points - station.position for station in trial.stations]
        azimuth = np.stack([np.arctan2(each[:, 1], each[:, 0]) for each in d])
        heading = np.array([station.heading for station in trial.stations])
        degrees = np.rad2deg(azimuth - heading[:, None])
        self.index = np.round(degrees).astype(int) % 360

    def step(self, snapshots: list[Complex], n_peaks: int) -> PositionEstimate:
        """Return the largest peaks of the map of a step."""
        level = np.zeros(len(self.points))
        for z, index in zip(snapshots, self.index, strict=True):
            if not np.isnan(z).all():
                spectrum = self._spectrum(z)
                level += spectrum[index] / spectrum.max()
        found = []
        for _ in range(n_peaks):
            peak = self.points[level.argmax()]
            apart = np.linalg.norm(self.points - peak, axis=1)
            level[apart < CLEARED * self.trial.size] = -1
            found.append(peak)
        return positions(np.array(found), np.full((n_peaks, 2, 2), np.nan))

    def _spectrum(self, z: Complex) -> Float:
        """Return the sum over bins of spectra (360,), each of maximum 1."""
        F, M = self.a.shape[0], self.a.shape[2]
        Y = z.reshape(F, -1, M)
        if Y.shape[1] < 8:
            power = (np.abs(self.a.conj() @ np.swapaxes(Y, 1, 2)) ** 2).sum(axis=-1)
        else:
            R = np.swapaxes(Y, 1, 2) @ Y.conj() / Y.shape[1]
            mean = np.trace(R, axis1=1, axis2=2).real / M
            inverse = np.linalg.inv(R + LOADING * mean[:, None, None] * np.eye(M))
            power = 1 / np.einsum("fgm,fmn,fgn->fg", self.a.conj(), inverse, self.a).real
        return np.asarray((power / power.max(axis=1, keepdims=True)).sum(axis=0))
