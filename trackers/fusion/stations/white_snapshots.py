"""Valid snapshots of a step in white noise, with the response of the sensors and its slope."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from arrivals.measurement_models.direction_measurement import DirectionMeasurement
from arrivals.measurement_models.manifolds.fourier import FourierManifold
from arrivals.measurement_models.manifolds.manifold import is_angle_manifold
from arrivals.measurement_models.observed import ObservedSnapshots
from arrivals.typing import Complex, Float

DIFFERENCE = 1e-5  # rad, of responses without an analytic derivative

Response = Callable[[Float], tuple[Complex, Complex]]


@dataclass(frozen=True, eq=False)
class StepSnapshots:
    """Valid snapshots of a step, in white noise, and the response of the sensors.

    Parameters
    ----------
    Y : ndarray of complex, shape (n_bins, n_sensors, n)
        Snapshots, or, of many, as few columns with the same covariance.
    n_snapshots : int
        Number of snapshots.
    response : callable
        Takes directions (K,), gives responses and derivatives, each (n_bins, n_sensors, K).
    is_line : bool
        True if directions are from broadside.
    """

    Y: Complex
    n_snapshots: int
    response: Response
    is_line: bool

    @property
    def n_sensors(self) -> int:
        """Number of valid sensors."""
        return int(self.Y.shape[1])

    @property
    def energy(self) -> float:
        """Energy of the snapshots."""
        return float(np.vdot(self.Y, self.Y).real)


def step_snapshots(measurement: DirectionMeasurement, z: ArrayLike | None) -> StepSnapshots | None:
    """Return the valid snapshots of a measurement, None if all of it is missing.

    Parameters
    ----------
    measurement : DirectionMeasurement
        Coherent noise is whitened, as `observe` and `manifold` do it. Of an unknown slowness or
        elevation that is averaged over a grid, each source has the value of the largest power in
        its direction. With two unknowns a source, waves are horizontal and plane.
    z : array_like or None
        Measurement.

    Returns
    -------
    StepSnapshots or None

    Raises
    ------
    ValueError
        If the shape of the measurement is wrong.

    Examples
    --------
    >>> from arrivals.measurement_models import ArraySnapshot, SensorArray
    >>> model = ArraySnapshot(SensorArray.uca(4, 0.4), wavelength=1.0)
    >>> step = step_snapshots(model, [1.0, 2.0, np.nan, 4.0])
    >>> step.Y.shape, step.energy, step.response(np.array([0.1, 0.2]))[1].shape
    ((1, 3, 1), 21.0, (1, 3, 2))
    """
    observed = measurement.observe(z)
    if observed is None:
        return None
    response = _response(measurement, observed)
    Y, n = observed.snapshots, observed.snapshots.shape[2]
    if n > 2 * Y.shape[1]:  # Y = R'Q', and all results depend on Y Y' = R'R alone
        R = np.asarray(np.linalg.qr(Y.conj().swapaxes(1, 2), mode="r"))
        Y = R.conj().swapaxes(1, 2)
    array = getattr(measurement, "array", None)
    return StepSnapshots(Y, n, response, bool(array is not None and array.dim == 1))


def _response(measurement: DirectionMeasurement, observed: ObservedSnapshots) -> Response:
    """Return the response of the valid sensors and bins, and its derivative."""
    manifold = observed.full_manifold
    if manifold is not None and not (observed.bins.all() and observed.sensors.all()):
        manifold = observed.manifold
    if isinstance(manifold, FourierManifold):
        return _fourier_response(manifold, observed.snapshots)
    if manifold is not None and is_angle_manifold(manifold):
        series = manifold
        return _differences(lambda doa: series.steering(series.from_doa(doa))[0])
    bins, sensors = observed.bins, observed.sensors

    def steering(doa: Float) -> Complex:
        a = measurement.steering_vector(doa).reshape(len(doa), len(bins), len(sensors))
        return np.moveaxis(a[:, bins][:, :, sensors], 0, 2)

    return _differences(steering)


def _differences(steering: Callable[[Float], Complex]) -> Response:
    """Return a response with its derivative by central differences."""

    def response(doa: Float) -> tuple[Complex, Complex]:
        a, before, after = np.split(
            steering(np.concatenate([doa, doa - DIFFERENCE, doa + DIFFERENCE])), 3, axis=2
        )
        return a, (after - before) / (2 * DIFFERENCE)

    return response


def _fourier_response(manifold: FourierManifold, Y: Complex) -> Response:
    G, jk = manifold.coefficients, 1j * manifold.harmonics[:, None]

    def response(doa: Float) -> tuple[Complex, Complex]:
        # a = G d,  ∂a/∂θ = G (jk ∘ d)
        d = np.exp(jk * doa)
        both = G @ np.concatenate([d, jk * d], axis=1)
        if len(G) == 1:
            return both[0, :, :, : len(doa)], both[0, :, :, len(doa) :]
        a, slope = np.split(both, 2, axis=3)  # (n_nuisance, n_bins, n_sensors, K)
        beams = np.abs(a.conj().swapaxes(2, 3) @ Y) ** 2
        power = beams.sum(axis=(1, 3)) / (np.abs(a) ** 2).sum(axis=(1, 2))
        best = power.argmax(axis=0)[None, None, None]
        return np.take_along_axis(a, best, axis=0)[0], np.take_along_axis(slope, best, axis=0)[0]

    return response
