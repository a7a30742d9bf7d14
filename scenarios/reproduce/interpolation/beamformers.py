"""Conventional and MVDR beamformers on whole records of real samples, for comparison."""

from __future__ import annotations

from typing import Literal, TypeAlias

import numpy as np
from numpy.typing import ArrayLike

from arrivals.measurement_models import ArraySamples, FlatBand, Tones
from arrivals.trackers.beamforming.covariance import diagonal_loading
from arrivals.trackers.beamforming.mvdr import capon_power
from arrivals.trackers.beamforming.spectrum import refine_peaks, scan_directions
from arrivals.typing import Complex, Float, Int
from arrivals.validation import one_of, real

Method: TypeAlias = Literal["conventional", "mvdr"]
N_DIRECTIONS = 361  # every half degree


def scan(
    samples: ArrayLike,
    measurement: ArraySamples,
    method: Method = "conventional",
    *,
    loading: float | None = None,
    refine: bool = True,
) -> float:
    """Return the direction, rad, of the maximum beam power over a record.

    A single tone is scanned with the covariance of its analytic signal, other sources with the
    bins of the record's spectrum in which the source has power.

    Parameters
    ----------
    samples : array_like, shape (n_steps, n_sensors)
        Real samples.
    measurement : ArraySamples
        Array, sampling rate and correlation of the source.
    method : {"conventional", "mvdr"}
        Beamformer.
    loading : float, optional
        Diagonal loading of MVDR, in mean powers of a sensor: 0.01 for a tone, 0.3 for a band if
        None.
    refine : bool
        Interpolate between the grid's directions. If false, scan whole degrees only: a truth on
        this grid then gives errors of exactly zero, an artefact.

    Returns
    -------
    float
        Direction, rad.

    Raises
    ------
    ValueError
        If the samples do not fit the array.

    References
    ----------
    Broad-band MVDR: Krolik and Swingler, "Multiple broad-band source location using steered
    covariance matrices", IEEE Trans. ASSP 37(10), 1989, (9).

    Examples
    --------
    >>> from arrivals.scenarios import create
    >>> trial = create("interpolation_tone", doa_deg=60.0).sample(np.random.default_rng(0))
    >>> bool(abs(np.rad2deg(scan(trial.measurements, trial.measurement)) - 60) < 1)
    True
    """
    samples = real("samples", samples)
    if samples.ndim != 2 or samples.shape[1] != measurement.array.n_sensors:
        raise ValueError(
            f"samples must have shape (n_steps, {measurement.array.n_sensors}); got {samples.shape}"
        )
    one_of("method", method, ("conventional", "mvdr"))
    narrow = isinstance(measurement.correlation, Tones) and measurement.correlation.order == 2
    kind = Narrowband if narrow else Broadband
    beams = kind(samples, measurement, method, loading)
    if not refine:
        degrees = np.deg2rad(np.arange(-90.0, 91.0))
        return float(degrees[_highest(beams.power(degrees))[0]])
    grid = scan_directions(measurement.array, N_DIRECTIONS)
    top = _highest(beams.power(grid))
    step = grid[1] - grid[0]
    fine = np.clip(grid[top] + step * np.linspace(-1, 1, 101), -np.pi / 2, np.pi / 2)
    power = beams.power(fine)
    return float(refine_peaks(fine, power, _highest(power))[0])


def _highest(power: Float) -> Int:
    """Return the index of the maximum, (1,), without the ends."""
    return np.array([1 + int(np.argmax(power[1:-1]))])


class Narrowband:
    """Beams of a tone, from the covariance of the analytic signal."""

    def __init__(
        self, samples: Float, measurement: ArraySamples, method: Method, loading: float | None
    ) -> None:
        from scipy.signal import hilbert

        z = hilbert(samples, axis=0)
        self.covariance = z.T @ z.conj() / len(z)
        self.method, self.loading = method, 0.01 if loading is None else loading
        self.array = measurement.array
        self.wavelength = self.array.wavelength(measurement.correlation.highest * measurement.rate)

    def power(self, doa: Float) -> Float:
        """Return the power of beams at directions (n,)."""
        A = self.array.steering_vector(doa, self.wavelength)
        if self.method == "mvdr":
            return capon_power(A, np.asarray(diagonal_loading(self.covariance, self.loading)))
        return np.asarray(((A.conj() @ self.covariance) * A).sum(axis=-1).real)


class Broadband:
    """Beams of a band, from the bins of the record's Fourier transform."""

    def __init__(
        self, samples: Float, measurement: ArraySamples, method: Method, loading: float | None
    ) -> None:
        frequencies: Float = np.fft.rfftfreq(len(samples)).astype(np.float64)
        used = bins(frequencies, measurement)
        self.Y: Complex = np.fft.rfft(samples, axis=0)[used]
        self.wavelengths = float(measurement.array.speed or np.nan) / (
            frequencies[used] * measurement.rate
        )
        self.method, self.loading = method, 0.3 if loading is None else loading
        self.array = measurement.array

    def power(self, doa: Float) -> Float:
        """Return the power of beams at directions (n,)."""
        A = self.array.steering_vector(doa[:, None], self.wavelengths)
        aligned = A.conj() * self.Y  # (n, n_bins, n_sensors)
        if self.method == "conventional":
            return np.asarray((np.abs(aligned.sum(axis=-1)) ** 2).sum(axis=-1))
        # the covariance of the aligned bins, steered
        R = (np.swapaxes(aligned, -1, -2) @ aligned.conj()).real / len(self.Y)
        ones = np.ones((self.array.n_sensors, 1))
        return np.asarray(
            1 / np.linalg.solve(diagonal_loading(R, self.loading), ones).sum(axis=(-2, -1))
        )


def bins(frequencies: Float, measurement: ArraySamples) -> Int:
    """Return the indices of the bins of a source: its band, or its tones and their neighbours.

    Examples
    --------
    >>> from arrivals.scenarios import create
    >>> bins(np.linspace(0, 0.5, 51), create("interpolation_qpc").measurement)
    array([ 9, 10, 11, 14, 15, 16, 24, 25, 26])
    """
    source = measurement.correlation
    low, high = (source.low, source.high) if isinstance(source, FlatBand) else (0, source.highest)
    if isinstance(source, Tones):
        nearest = np.abs(frequencies[:, None] - np.asarray(source.frequencies)).argmin(axis=0)
        index = np.unique(nearest[:, None] + [-1, 0, 1])
        return index[(index > 0) & (index < len(frequencies))]
    return np.flatnonzero((frequencies >= max(low, 1e-12)) & (frequencies <= high))
