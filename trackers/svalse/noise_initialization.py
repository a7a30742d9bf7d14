"""Initial estimates of the noise, and floors of noise and power."""

from __future__ import annotations

import numpy as np

from arrivals.typing import Complex, Float, Int

NOISE_FLOOR = 1e-9  # of the power: avoids a division by zero without noise


def noise_floor(max_snr_db: float | None) -> float:
    """Return the smallest noise, as a share of the power: the rest counts as model error.

    Examples
    --------
    >>> noise_floor(None), noise_floor(20.0)
    (1e-09, 0.01)
    """
    return NOISE_FLOOR if max_snr_db is None else 10 ** (-max_snr_db / 10)


def power_floor(floor: float | None, n_snapshots: int) -> float:
    """Return the smallest power of a source, in units of the noise after beamforming.

    Parameters
    ----------
    floor : float or None
        None: 0 for one snapshot a step, which is the paper's model, and 3 for several.
    n_snapshots : int

    Examples
    --------
    >>> power_floor(None, 1), power_floor(None, 10), power_floor(0.0, 10)
    (0.0, 3.0, 0.0)
    """
    if floor is not None:
        return floor
    return 0.0 if n_snapshots == 1 else 3.0


def initial_noise(y: Complex, grid_index: Int, snr_db: float | None) -> float:
    """Return ν by an expected signal-to-noise ratio, or by the small eigenvalues of the lags.

    Parameters
    ----------
    y : ndarray, shape (n_sensors,)
    grid_index : ndarray of int, shape (n_sensors,)
        Grid points of the sensors, integers.
    snr_db : float or None
        None: the mean of the ⌊M/4⌋ smallest eigenvalues of the Toeplitz matrix of the biased lags.
    """
    M, power = len(y), float(np.vdot(y, y).real)
    if snr_db is not None:
        return power / M * 10 ** (-snr_db / 10)
    lags = autocorrelation(y, grid_index) / M
    apart = np.subtract.outer(grid_index, grid_index)
    toeplitz = np.where(apart < 0, lags[np.abs(apart)].conj(), lags[np.abs(apart)])
    smallest = np.linalg.eigvalsh(toeplitz)[: max(M // 4, 1)]
    return max(float(smallest.mean()), NOISE_FLOOR * power / M)


def noise_from_eigenvalues(Y: Complex) -> Float:
    """Return the noise of each bin, (n_bins,), by the smaller half of its covariance's eigenvalues.

    Divided by the share of noise in them if the larger half were sources.

    Parameters
    ----------
    Y : ndarray, shape (n_bins, n_sensors, n_snapshots)
        At least as many snapshots as sensors, two of them or more.

    Examples
    --------
    >>> rng = np.random.default_rng(0)
    >>> noise = rng.standard_normal((1, 8, 1000, 2)) @ np.array([1, 1j]) / np.sqrt(2)
    >>> noise_from_eigenvalues(noise + 10 * rng.standard_normal(1000)).round(1)
    array([0.9])
    """
    M, N = Y.shape[1:]
    smallest = np.linalg.eigvalsh(Y @ Y.conj().swapaxes(1, 2))[:, : max(M // 2, 1)]
    power = (Y.real**2 + Y.imag**2).sum(axis=(1, 2)) / (M * N)
    return np.asarray(np.maximum(smallest.mean(axis=1) / (N - M / 2), NOISE_FLOOR * power + 1e-300))


def autocorrelation(z: Complex, grid_index: Int) -> Complex:
    """Return the lags Rᵢ = Σ z_{k+i} z*_k, i = 0 .. span, of samples at integer positions.

    Examples
    --------
    >>> autocorrelation(np.array([1, 1j]), np.array([0, 2])).round(6) + 0
    array([2.+0.j, 0.+0.j, 0.+1.j])
    """
    span = int(grid_index.max() - grid_index.min())
    line = np.zeros(span + 1, dtype=np.complex128)
    line[grid_index - grid_index.min()] = z
    spectrum = np.fft.fft(line, 1 << int(np.ceil(np.log2(2 * span + 2))))
    return np.asarray(np.fft.ifft(spectrum.real**2 + spectrum.imag**2)[: span + 1])
