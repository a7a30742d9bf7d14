"""Direction of arrival from the phase step between neighbouring sensors."""

import numpy as np
from numpy.typing import ArrayLike

from arrivals.measurement_models import ArraySnapshot
from arrivals.measurements import is_missing
from arrivals.trackers import DirectionEstimate, Tracker
from arrivals.validation import instance, no_control, positive, time_step


class LagOne(Tracker):
    """Exponentially weighted mean phase step of a uniform line.

    Parameters
    ----------
    measurement : ArraySnapshot
        Its array is a uniform line.
    memory : float
        Weight of the past after one step.
    """

    def __init__(self, measurement: ArraySnapshot, memory: float = 0.5) -> None:
        self.measurement = instance("measurement", measurement, ArraySnapshot)
        self.memory = positive("memory", memory)
        self.lag, self.power = 0j, 0.0
        self.x, self.P = np.full(1, np.nan), np.zeros((1, 1))

    def predict(self, u: ArrayLike | None = None, *, dt: float = 1.0) -> None:
        """Apply forgetting; add to the variance."""
        dt = time_step(dt)
        no_control(u)
        self.P = self.P + 0.01 * dt
        self.lag, self.power = self.lag * self.memory**dt, self.power * self.memory**dt

    def update(self, z: ArrayLike | None) -> None:
        """Add the products of neighbouring sensors that both have valid data."""
        if is_missing(z):
            return
        z = self.measurement.snapshot(z)
        products = z[1:] * z[:-1].conj()
        lag = self.lag + np.nansum(products)
        power = self.power + np.nansum(np.abs(products))
        if power > 0:
            model = self.measurement
            phase_scale = 2 * np.pi * (model.array.spacing or np.inf) / model.wavelengths[0]
            sine = np.angle(lag) / phase_scale
            self.x = np.arcsin(np.clip([sine], -1.0, 1.0))
            self.P = np.array([[1 - abs(lag) / power]])
        self.lag, self.power = lag, power

    @property
    def estimate(self) -> DirectionEstimate:
        """Direction, after the first valid measurement."""
        doa = self.x[~np.isnan(self.x)]
        n = len(doa)
        std = np.sqrt(np.maximum(self.P[0, :n], 0.0))
        unknown = np.full(n, complex(np.nan, np.nan))
        return DirectionEstimate(doa, std, np.full(n, np.nan), unknown, np.zeros(n, dtype=np.int64))
