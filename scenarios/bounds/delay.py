"""Bounds on the standard deviation of a direction from real samples of a line array."""

from __future__ import annotations

import numpy as np

from arrivals.measurement_models import ArraySamples, FlatBand, Tones
from arrivals.typing import Float
from arrivals.validation import count, instance, number


def tone_bound(measurement: ArraySamples, doa: float, n_steps: int) -> float:
    """Return the deterministic Cramér-Rao bound of a source of tones, a standard deviation, rad.

    Amplitude and phase of each tone are unknown, its frequency is known:

        J = SNR · M · N(N²-1)/12 · Σ pᵢωᵢ²,    std = J^(-1/2) / (κ cos β)

    Parameters
    ----------
    measurement : ArraySamples
        Its correlation must be `Tones`.
    doa : float
        Direction, rad.
    n_steps : int
        M, snapshots.

    Raises
    ------
    TypeError
        If the source does not consist of tones.

    References
    ----------
    Stoica and Nehorai, "MUSIC, maximum likelihood, and Cramér-Rao bound", IEEE Trans. ASSP 37(5),
    1989, (2.11), for one source and real samples.

    Examples
    --------
    >>> from arrivals.scenarios import create
    >>> model = create("interpolation_tone").measurement
    >>> round(float(np.rad2deg(tone_bound(model, np.deg2rad(60.0), 100))), 5)
    0.22583
    """
    source = instance("correlation", _samples(measurement).correlation, Tones)
    slope = (source.shares * source.omega**2).sum()
    J = count("n_steps", n_steps) * _aperture(measurement) * slope / measurement.noise_ratio
    return _angle_std(measurement, doa, float(J))


def band_bound(measurement: ArraySamples, doa: float, n_steps: int) -> float:
    """Return the stochastic Cramér-Rao bound of a flat band, a standard deviation, rad.

    The limit of many snapshots. With η = SNR / (2 (f₂-f₁)),

        J = M N(N²-1)/12 ∫ 2η Nη/(1+Nη) (2πf)² df,    std = J^(-1/2) / (κ cos β)

    Below about a hundred snapshots it is too low; see `exact_bound`.

    Parameters
    ----------
    measurement : ArraySamples
        Its correlation must be a `FlatBand`.
    doa : float
        Direction, rad.
    n_steps : int
        M, snapshots.

    Raises
    ------
    TypeError
        If the source is not a flat band.

    Examples
    --------
    >>> from arrivals.scenarios import create
    >>> model = create("interpolation_band").measurement
    >>> round(float(np.rad2deg(band_bound(model, np.deg2rad(60.0), 100))), 4)
    0.31
    """
    source = instance("correlation", measurement.correlation, FlatBand)
    eta = 1 / (2 * measurement.noise_ratio * (source.high - source.low))
    gain = measurement.array.n_sensors * eta
    integral = (2 * np.pi) ** 2 * (source.high**3 - source.low**3) / 3
    J = count("n_steps", n_steps) * _aperture(measurement) * 2 * eta * gain / (1 + gain) * integral
    return _angle_std(measurement, doa, float(J))


def exact_bound(measurement: ArraySamples, doa: float, n_steps: int) -> float:
    """Return the stochastic Cramér-Rao bound of any Gaussian source, a standard deviation, rad.

    J = tr(C⁻¹C'C⁻¹C') / 2 with the covariance C of all samples; exact for few snapshots.

    Parameters
    ----------
    measurement : ArraySamples
    doa : float
        Direction, rad.
    n_steps : int
        M, snapshots; a matrix of size M times the number of sensors is solved.

    Examples
    --------
    >>> from arrivals.scenarios import create
    >>> model = create("interpolation_band").measurement
    >>> round(float(np.rad2deg(exact_bound(model, np.deg2rad(60.0), 25))), 3)
    0.71
    """
    _samples(measurement)
    k, j = np.divmod(np.arange(count("n_steps", n_steps) * len(measurement.grid_index)),
                     len(measurement.grid_index))  # fmt: skip
    apart = np.subtract.outer(measurement.grid_index[j], measurement.grid_index[j])
    lag = np.subtract.outer(k, k) - apart * measurement.delay(doa)
    C = measurement.correlation.rho(lag) + measurement.noise_ratio * np.eye(len(k))
    slope = -apart * measurement.correlation.drho(lag)
    solved = np.linalg.solve(C, slope)
    return _angle_std(measurement, doa, float((solved * solved.T).sum() / 2))


def _samples(measurement: ArraySamples) -> ArraySamples:
    return instance("measurement", measurement, ArraySamples)


def _aperture(measurement: ArraySamples) -> float:
    """Return Σ (j - mean)², which is N(N²-1)/12 for a line without gaps."""
    grid_index: Float = measurement.grid_index.astype(np.float64)
    return float(((grid_index - grid_index.mean()) ** 2).sum())


def _angle_std(measurement: ArraySamples, doa: float, information: float) -> float:
    return float(1 / (np.sqrt(information) * measurement.kappa * np.cos(number("doa", doa))))
