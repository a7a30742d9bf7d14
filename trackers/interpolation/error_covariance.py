"""Covariance of the error of pairwise updates, whose residuals are taken to be independent.

Neighbouring residuals share samples, and all share the source, of which an interpolation leaves
out a part. The gains ignore that, and the covariance P that belongs to them; M is the covariance
of the error that they leave, after Huber's sandwich P (Σ var of the score) P.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from arrivals.measurement_models.delays.interpolation import InterpolationDelay
from arrivals.measurement_models.delays.source_correlation import SourceCorrelation, Tones
from arrivals.parameters import FrozenModel
from arrivals.typing import Complex, Float, Int

N_FREQUENCIES = 512
DENSITY = 8  # delays of a table per sample: interpolation errors have the period of one sample
TINY = np.finfo(float).tiny


@dataclass(frozen=True, eq=False)
class ScoreTable(FrozenModel):
    """Moments of the score G = Σ H e / R of a snapshot, over the information i = Σ H² / R.

    Parameters
    ----------
    delays : ndarray, shape (n_delays,)
    noise : ndarray, shape (n_sets, n_delays)
        Long-run variance of G over E i; 1 for independent residuals. One row for the shortest
        baseline, the two shortest, and so on.
    slope : ndarray, shape (n_sets,)
        Mean slope of G over E i, 1 where noise biases no delay.
    square_frequency : ndarray, shape (n_sets,), or None
        Ω², rad² per sample²: an error d of the delay changes the mean of G by sin(Ωd)/Ω. None if
        the residuals are linearized again after each sensor.
    """

    delays: Float
    noise: Float
    slope: Float
    square_frequency: Float | None

    @classmethod
    def of(
        cls, models: tuple[InterpolationDelay, ...], kappa: float, sequential: bool
    ) -> ScoreTable:
        """Return the table of baselines."""
        delays = np.linspace(-kappa, kappa, 2 * math.ceil(DENSITY * kappa) + 1)
        lengths = sorted({abs(model.baseline) for model in models})
        sets = [[model for model in models if abs(model.baseline) <= m] for m in lengths]
        noise, slope, square = np.swapaxes([score_moments(each, delays) for each in sets], 0, 1)
        square_frequency = None if sequential else np.maximum(square.mean(axis=-1), TINY)
        return cls(delays, noise, slope.mean(axis=-1), square_frequency)

    def noise_at(self, delay: Float, row: Int | int) -> Float:
        """Return the noise of row `row` at delays, interpolated."""
        if len(self.noise) == 1:
            return np.asarray(np.interp(delay, self.delays, self.noise[0]))
        position = (delay - self.delays[0]) / (self.delays[1] - self.delays[0])
        first = np.clip(position.astype(np.int64), 0, len(self.delays) - 2)
        share = position - first
        return np.asarray((1 - share) * self.noise[row, first] + share * self.noise[row, first + 1])

    def updated(self, M: Float, prior: Float, x: Float, P: Float, row: Int | int) -> Float:
        """Return the covariance of the error after a snapshot.

        Parameters
        ----------
        M : ndarray, shape (..., n, n)
            That before it; the delay is element 0.
        prior, P : ndarray, shape (..., n, n)
            The filter's own before and after it.
        x : ndarray, shape (..., n)
            Mean after it.
        row : int or ndarray, shape (...)
            Row of the table: that of the baselines in use.
        """
        own, variance = P[..., 0, 0], M[..., 0, 0]
        before = np.maximum(prior[..., 0, 0], TINY)
        # d <- d - g G/i, with g = P₀₀ i / (1 + i P₀₀), and E G = λ sin(Ωd)/Ω
        g = 1 - own / before
        pull, square = self.slope[row] * g, variance
        linear = pull
        if self.square_frequency is not None:
            # E d sin(Ωd)/Ω = M exp(-u/2), E (sin(Ωd)/Ω)² = (1 - exp(-2u)) / 2Ω², u = Ω²M,
            # for d ~ (0, M): the statistical linearization
            omega2 = self.square_frequency[row]
            u = omega2 * variance
            linear, square = pull * np.exp(-0.5 * u), np.expm1(-2 * u) / (-2 * omega2)
        # E (g G/i)² = P g var(G)/i + (λ g)² E (sin(Ωd)/Ω)²
        spread = self.noise_at(x[..., 0], row) * own * g + pull * pull * square
        # M <- M - b c' - c b', b = P₀ / P₀₀: the other elements follow the delay
        if M.shape[-1] == 1:
            return np.asarray((variance * (1 - 2 * linear) + spread)[..., None, None])
        b = prior[..., 0] / before[..., None]
        change = linear[..., None] * M[..., 0] - 0.5 * spread[..., None] * b
        change = b[..., :, None] * change[..., None, :]
        return np.asarray(M - change - np.swapaxes(change, -1, -2))


def score_moments(models: list[InterpolationDelay], delays: Float) -> tuple[Float, Float, Float]:
    """Return the moments of `ScoreTable` for baselines in use together, (n_delays,) each.

    The score is a quadratic form of the samples, with the matrix Q(f) at a frequency, and samples
    have the spectrum S a a' + V I: source and noise. For Gaussian samples, the sum of many scores
    has the variance 2 ∫ tr (Q (S a a' + V I))² df a snapshot (Isserlis). A tone is not Gaussian:
    what it adds by itself is periodic, and its sum bounded.
    """
    f = (np.arange(N_FREQUENCIES) + 0.5) / (2 * N_FREQUENCIES)
    source, tones = models[0].interpolator.correlation, False
    if isinstance(source, Tones):
        lines, power, tones = source.omega / (2 * np.pi), source.shares, True
    else:
        lines, power = f, spectrum(source, f)
    V, V_lines = noise_spectrum(models[0], f), noise_spectrum(models[0], lines)
    form, line_form = ScoreForm(models, delays, f), ScoreForm(models, delays, lines)
    # tr (Q S)² = V² |Q|² + 2 V S |Qa|² + S² (a'Qa)²
    variance = 2 * (form.square * V**2).mean(axis=-1)
    variance += 4 * line_form.rows @ (V_lines * power)
    if not tones:
        variance += 2 * len(f) * line_form.total**2 @ power**2
    information = (form.information * V).mean(axis=-1) + line_form.information @ power
    slope = line_form.slope @ power
    square = np.maximum(line_form.third_derivative @ power / slope, 0.0)
    return variance / information, slope / information, square


class ScoreForm:
    """Quadratic form of the score at delays and frequencies, arrays (n_delays, n_frequencies).

    In coordinates in which the source has the phase 0 at all sensors: `square`, `rows` and
    `total` are |Q|², |Qa|² and a'Qa.
    """

    def __init__(self, models: list[InterpolationDelay], delays: Float, f: Float) -> None:
        n, shape = models[0].n_sensors, (len(delays), len(f))
        self.information, self.slope, self.third_derivative = np.zeros((3, *shape))
        diagonal, rows = np.zeros((n, *shape)), np.zeros((n, *shape), dtype=np.complex128)
        off_diagonal: dict[int, Complex] = {}  # entries of Q at sensors so far apart
        for model in models:
            m, first, source = model.baseline, max(model.baseline, 0), max(-model.baseline, 0)
            targets, sources = (
                slice(first, first + model.dim_z),
                slice(source, source + model.dim_z),
            )
            taps, R = model.linearise(delays)
            waves = np.exp(-2j * np.pi * np.multiply.outer(model.interpolator.offsets, f))
            c, slope = taps[:, 0] @ waves, m * (taps[:, 1] @ waves)
            phase = 2 * np.pi * m * f
            a = np.exp(-1j * delays[:, None] * phase)
            # G = H* e / R = y_i* c'* (y_j - c y_i) / R, its symmetric part
            mixed, own = 0.5 * np.conj(slope) * a / R[:, None], np.conj(slope) * c / R[:, None]
            rows[sources] += mixed - own.real
            rows[targets] += np.conj(mixed)
            diagonal[sources] -= own.real
            entry = off_diagonal.get(abs(m), 0.0)
            off_diagonal[abs(m)] = np.asarray(entry + (mixed if m > 0 else np.conj(mixed)))
            self.information += model.dim_z * np.abs(slope) ** 2 / R[:, None]
            mean_slope = 2 * model.dim_z * (mixed * -1j * phase).real
            self.slope += mean_slope
            self.third_derivative += mean_slope * phase**2
        self.square = (diagonal**2).sum(axis=0)
        self.square += sum(2 * (n - m) * np.abs(entry) ** 2 for m, entry in off_diagonal.items())
        self.rows = (np.abs(rows) ** 2).sum(axis=0)
        self.total = rows.sum(axis=0).real


def spectrum(source: SourceCorrelation, f: Float) -> Float:
    """Return shares of the power at frequencies, cycles per sample, evenly over (0, 1/2).

    Examples
    --------
    >>> from arrivals.measurement_models import FlatBand
    >>> spectrum(FlatBand(0.0, 0.25), np.array([0.125, 0.375])).round(6) + 0.0
    array([1., 0.])
    """
    lags = np.arange(1, N_FREQUENCIES)
    # Σ w ρ cos 2πfl, in Hann's window w: its leakage is far below an interpolation error
    weights = (1 + np.cos(np.pi * lags / N_FREQUENCIES)) * source.rho(lags)
    density = np.maximum(1 + np.cos(2 * np.pi * np.multiply.outer(f, lags)) @ weights, 0.0)
    return np.asarray(density / density.sum())


def noise_spectrum(model: InterpolationDelay, f: Float) -> Float:
    """Return the spectrum of the noise, over the power of the source, at frequencies."""
    noise_filter = model.interpolator.noise_filter
    if noise_filter is None:
        return np.full(len(f), model.noise_ratio)
    passed = np.abs(np.fft.rfft(noise_filter.response)) ** 2
    return np.asarray(model.noise_ratio * np.interp(f, np.linspace(0, 0.5, len(passed)), passed))
