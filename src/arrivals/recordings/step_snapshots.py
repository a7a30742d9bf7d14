"""Snapshots of a step: reduced to their covariance, or at frequencies that are followed."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from arrivals.typing import Bool, Complex
from arrivals.validation import positive

ROWS = 8  # reduced snapshots a channel
PER_BIN = 4  # candidates in the width of a bin: an eighth of it is the largest error, 0.1 dB


def reduced_number(n_snapshots: int, n_channels: int) -> int:
    """Return the number of snapshots in a reduced step, at most eight a channel.

    Examples
    --------
    >>> reduced_number(4800, 5), reduced_number(10, 5)
    (40, 10)
    """
    return min(n_snapshots, ROWS * n_channels)


def reduced_snapshots(steps: Complex) -> Complex:
    """Return at most eight snapshots a channel, whose sample covariance is that of the step's.

    With the snapshots as rows of Y (N, M), and R = Yᴴ Y / N = U Λ Uᴴ, those of the result are
    W = √K F Λ^½ Uᴴ, so that Wᴴ W / K = R. To a method that depends on snapshots by their sample
    covariance they are as N snapshots, of which N / K count as one. The columns of F, the first M
    of the unitary DFT matrix (K, K), give each of them the same share of all sources and of the
    noise, for methods that compare the snapshots' noise.

    Parameters
    ----------
    steps : ndarray, shape (..., n_snapshots, n_channels)
        Snapshots; NaN where missing. Those with some channels missing are left out, unless a
        channel is missing in all of them.

    Returns
    -------
    ndarray, shape (..., reduced_number(n_snapshots, n_channels), n_channels)
        NaN where a channel is missing in all snapshots; unchanged if there are no more snapshots.

    Examples
    --------
    >>> y = np.exp(1j * np.arange(200)).reshape(100, 2)
    >>> w = reduced_snapshots(y)
    >>> w.shape, np.allclose(w.conj().T @ w / 16, y.conj().T @ y / 100)
    ((16, 2), True)
    """
    n, m = steps.shape[-2:]
    k = reduced_number(n, m)
    if k == n:
        return steps
    valid: Bool = np.asarray(~np.isnan(steps))
    present: Bool = np.any(valid, axis=-2, keepdims=True)
    complete: Bool = np.all(valid | ~present, axis=-1, keepdims=True)
    complete &= present.any(axis=-1, keepdims=True)
    y = steps if complete.all() and present.all() else np.where(complete & present, steps, 0.0)
    # R = Yᴴ Y / N
    R = y.conj().swapaxes(-1, -2) @ y / np.maximum(complete.sum(axis=-2, keepdims=True), 1)
    power, U = np.linalg.eigh(R)
    F = np.exp(-2j * np.pi / k * np.outer(np.arange(k), np.arange(m))) / np.sqrt(k)
    # W = √K F Λ^½ Uᴴ
    W = F @ (np.sqrt(k * np.maximum(power, 0.0))[..., None] * U.conj().swapaxes(-1, -2))
    usable = present & complete.any(axis=-2, keepdims=True)
    return np.where(usable, W, complex(np.nan, np.nan))


def candidate_frequencies(
    frequencies: Sequence[float], half_width: float, resolution: float
) -> list[float]:
    """Return frequencies around each of the given ones, a quarter of a bin apart.

    Parameters
    ----------
    frequencies : sequence of float
        Nominal frequencies, Hz.
    half_width : float
        Largest shift, Hz.
    resolution : float
        Rate over window, Hz.

    Returns
    -------
    list of float
        As many for each frequency, in ascending order.

    Raises
    ------
    ValueError
        If a shift would reach zero.

    Examples
    --------
    >>> candidate_frequencies([100.0, 200.0], 1.0, 2.0)
    [99.0, 99.5, 100.0, 100.5, 101.0, 199.0, 199.5, 200.0, 200.5, 201.0]
    """
    half_width, lowest = positive("follow", half_width), min(frequencies)
    if half_width >= lowest:
        raise ValueError(f"follow must lie below the frequency, {lowest:g} Hz; got {half_width:g}")
    n = int(np.ceil(PER_BIN * half_width / resolution * (1 - 1e-12)))
    shifts = np.linspace(-half_width, half_width, 2 * n + 1)
    return [float(each + shift) for each in frequencies for shift in shifts]


def strongest_candidates(values: Complex, n_frequencies: int) -> Complex:
    """Return the amplitudes at the candidate of each frequency that has most power in a step.

    Parameters
    ----------
    values : ndarray, shape (n_steps, n_frequencies * n_candidates, n_snapshots, n_channels)
        Amplitudes at `candidate_frequencies`; the axis of snapshots may be left out. NaN where
        missing.
    n_frequencies : int
        Number of nominal frequencies.

    Returns
    -------
    ndarray, shape (n_steps, n_frequencies, n_snapshots, n_channels)
        The second axis is left out for one frequency.

    Examples
    --------
    >>> values = np.zeros((1, 6, 2), complex)
    >>> values[0, 1], values[0, 5] = 3.0, 4.0
    >>> strongest_candidates(values, 2)[0].real
    array([[3., 3.],
           [4., 4.]])
    """
    n_steps, n, *rest = values.shape
    grouped = values.reshape(n_steps, n_frequencies, n // n_frequencies, -1)
    power = np.nan_to_num(grouped.real**2 + grouped.imag**2).sum(axis=-1)
    best = power.argmax(axis=2)[:, :, None, None]
    chosen = np.take_along_axis(grouped, best, axis=2).reshape(n_steps, n_frequencies, *rest)
    return chosen[:, 0] if n_frequencies == 1 else chosen
