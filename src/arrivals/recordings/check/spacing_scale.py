"""Size of an array from the delays between its channels."""

from __future__ import annotations

import numpy as np

from arrivals.measurement_models import SensorArray
from arrivals.recordings.check.segments import PhaseSegments, channel_pairs
from arrivals.typing import Complex, Float, Int

INTERPOLATION = 4  # points of the correlation for each sample
N_ITERATIONS = 8  # of the reweighted least squares
MAX_RESIDUAL = 0.1  # median, of the largest delay of the fit, beside the error of delays
DELAY_ERROR = 0.5  # samples, of delays in echoes
MIN_SEGMENTS = 3
QUANTILES = (0.1, 0.9)


def pair_delays(segments: PhaseSegments, pairs: Int, rate: float) -> Float:
    """Return delays of the second channel of each pair after the first, s, by phase correlation.

    Parameters
    ----------
    segments : PhaseSegments
        At consecutive bins of one window.
    pairs : ndarray of int, shape (n_pairs, 2)
        Channels.
    rate : float
        Samples per second, Hz.

    Returns
    -------
    ndarray, shape (n_segments, n_pairs)

    Examples
    --------
    >>> f = np.arange(4, 29) * 1000 / 64
    >>> u = np.exp(-2j * np.pi * f[:, None, None] * np.array([0.0, 0.003]))[None]
    >>> segments = PhaseSegments(u, np.ones((1, 25)), f, 64)
    >>> pair_delays(segments, np.array([[0, 1]]), 1000.0)
    array([[0.003]])
    """
    first = round(segments.frequency[0] * segments.window / rate)
    n = INTERPOLATION * segments.window
    result = np.zeros((len(segments.phasors), len(pairs)))
    for k, (i, j) in enumerate(pairs):
        one, other = segments.phasors[..., i], segments.phasors[..., j]
        spectrum: Complex = np.zeros((len(one), n // 2 + 1), complex)
        cross = segments.weight * np.einsum("tfn,tfn->tf", other, one.conj())
        spectrum[:, first : first + cross.shape[1]] = cross
        correlation = np.fft.irfft(spectrum, n)
        peak = correlation.argmax(axis=1)
        around = (peak[:, None] + np.array([-1, 0, 1])) % n
        left, middle, right = np.take_along_axis(correlation, around, axis=1).T
        curvature = left - 2 * middle + right
        shift = np.where(curvature < 0, 0.5 * (left - right) / np.minimum(curvature, -1e-30), 0.0)
        result[:, k] = (peak - n * (peak >= n // 2) + shift) / (INTERPOLATION * rate)
    return result


def spacing_scale(segments: PhaseSegments, array: SensorArray, rate: float) -> Float | None:
    """Return how many times larger the delays are than those of horizontal waves on the array.

    Parameters
    ----------
    segments : PhaseSegments
        At consecutive bins of one window, one channel a sensor.
    array : SensorArray
        With a wave speed.
    rate : float
        Samples per second, Hz.

    Returns
    -------
    ndarray, shape (2,) or None
        Deciles 1 and 9 over segments of |s| c, with the slowness vector s of the plane wave that
        fits the delays best, and c the wave speed, widened by half a sample in the aperture; None
        if plane waves do not fit. Waves from outside of the plane, or from the side of a line,
        have less than 1.

    Examples
    --------
    >>> array = SensorArray.ula(4, 1.0, speed=340.0)
    >>> f = np.arange(4, 29) * 1000 / 64
    >>> delay = 3 * array.positions[:, 0] / 340
    >>> u = np.exp(2j * np.pi * f[:, None, None] * delay)[None].repeat(4, axis=0)
    >>> segments = PhaseSegments(u, np.ones((4, 25)), f, 64)
    >>> spacing_scale(segments, array, 1000.0).round(2)
    array([2.94, 3.06])
    """
    pairs = channel_pairs(segments.n_channels)
    baseline = array.positions[pairs[:, 0]] - array.positions[pairs[:, 1]]
    if len(segments.phasors) < MIN_SEGMENTS or len(pairs) <= array.dim:
        return None
    delays = pair_delays(segments, pairs, rate)
    weight = np.ones_like(delays)
    slowness = np.zeros((len(delays), array.dim))
    for _ in range(N_ITERATIONS):  # least absolute deviations
        normal = np.einsum("tp,pi,pj->tij", weight, baseline, baseline)
        moment = np.einsum("tp,pi,tp->ti", weight, baseline, delays)
        slowness = np.einsum("tij,tj->ti", np.linalg.pinv(normal), moment)
        residual = np.abs(delays - slowness @ baseline.T)
        weight = 1 / np.maximum(residual, 0.05 / rate)
    largest = np.abs(slowness @ baseline.T).max(axis=1)
    fits = np.median(residual, axis=1) <= MAX_RESIDUAL * largest + DELAY_ERROR / rate
    if fits.sum() < MIN_SEGMENTS or array.speed is None:
        return None
    size = np.linalg.norm(slowness[fits], axis=1) * array.speed
    aperture = np.linalg.norm(baseline, axis=1).max()
    low, high = np.quantile(size, QUANTILES)
    error = DELAY_ERROR / rate * array.speed / aperture
    return np.array([max(0.0, low - error), high + error])
