"""Gaussian interface of complex snapshots of one source."""

from __future__ import annotations

from abc import abstractmethod

import numpy as np
from numpy.typing import ArrayLike

from arrivals.measurement_models.base import MeasurementModel
from arrivals.measurement_models.snapshot_likelihood import composite
from arrivals.typing import Complex, Float
from arrivals.validation import shaped, state


class SingleSourceSnapshot(MeasurementModel):
    """Snapshots z = w a(β) + u of one source with a state [β, Re w, Im w].

    Measurements are real, `composite(z)`. A model defines the response a(β) and its slope.

    Notes
    -----
    Shapes: states (..., 3), measurements (..., dim_z). Units: rad and those of the snapshots.
    """

    noise: float

    @abstractmethod
    def response_to(self, doa: ArrayLike) -> Complex | Float:
        """Return a(β) of directions (...), rad: (..., n_sensors)."""

    @abstractmethod
    def response_slope(self, doa: float) -> Complex | Float:
        """Return da/dβ at one direction, rad: (n_sensors,)."""

    @property
    def needs(self) -> tuple[str, ...]:
        """doa, amplitude_re, amplitude_im."""
        return "doa", "amplitude_re", "amplitude_im"

    @property
    def R(self) -> Float:
        """Covariance of the composite noise: half the variance for each part."""
        return self.noise / 2 * np.eye(self.dim_z)

    def h(self, x: ArrayLike) -> Float:
        """Return the composite snapshot of states [β, Re w, Im w]: (..., 3) -> (..., dim_z)."""
        doa, re, im = np.moveaxis(state(x, 3), -1, 0)
        return composite((re + 1j * im)[..., None] * self.response_to(doa))

    def H(self, x: ArrayLike) -> Float:
        """Return the Jacobian of `h` at one state, (dim_z, 3)."""
        doa, re, im = shaped("x", x, 3)
        a, da = self.response_to(doa), self.response_slope(doa)
        return np.stack([composite((re + 1j * im) * da), composite(a), composite(1j * a)]).T
