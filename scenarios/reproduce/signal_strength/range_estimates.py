"""Ranges and positions by several approximations of the statistic of signal strength."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from arrivals.measurement_models import db_to_neper
from arrivals.measurement_models.signal_strength.envelope import (
    envelope_moments,
    log_envelope_moments,
    sample_log_envelope,
)
from arrivals.measurement_models.signal_strength.path_loss import PropagationModel, slopes
from arrivals.scenarios.simulations.signal_strength import in_disc
from arrivals.typing import Float

LOG, EXACT, AMPLITUDE, ENERGY = (
    "log-Gaussian (the paper)", "log-Gaussian, exact moments", "Gaussian amplitude",
    "Gaussian energy",
)  # fmt: skip
FORMS = (LOG, EXACT, AMPLITUDE, ENERGY)
POWER, NOISE = (float(db_to_neper(level)) for level in (80.0, 40.0))
RANGE, DISC, N_SENSORS = 30.0, 100.0, 100  # m, m
DRAWS = 20_000  # of a single sensor


class Errors(NamedTuple):
    """Errors of an estimate, one for each draw, and their stated standard deviation.

    Parameters
    ----------
    error : ndarray
        Of the range, in parts of it, (n_draws,); or of the position, m, (n_draws, 2).
    stated : ndarray
        Standard deviation of each coordinate by the assumed form, of the shape of `error`.
    """

    error: Float
    stated: Float


def range_errors(form: str, n_snapshots: int, rng: np.random.Generator) -> Errors:
    """Return errors of the range of a source of known power, by one sensor 30 m away.

    The estimate is the maximum of the likelihood of the form, with the variances that grow with
    the level: log e ~ N(log σ, 1/4N), e ~ N(σ, σ²/4N), or e² ~ N(σ², σ⁴/N).

    Parameters
    ----------
    form : str
        One of `FORMS`.
    n_snapshots : int
    rng : Generator

    Examples
    --------
    >>> errors = range_errors(LOG, 50, np.random.default_rng(0))
    >>> round(float(errors.error.mean() / errors.stated.mean()), 2)
    0.11
    """
    N = n_snapshots
    level = 0.5 * np.logaddexp(2 * POWER - 2 * np.log(RANGE), 2 * NOISE)
    xi = level + sample_log_envelope(N, (DRAWS,), rng)
    # maximum of the likelihood: log σ = log e - shift, with information J about log σ
    shift, J = {
        LOG: (0.0, 4.0 * N),
        EXACT: (float(log_envelope_moments(N)[0]), 1 / float(log_envelope_moments(N)[1])),
        AMPLITUDE: (np.log((1 + np.sqrt(1 + 1 / N)) / 2), 4.0 * N + 2),
        ENERGY: (0.5 * np.log((1 + np.sqrt(1 + 4 / N)) / 2), 4.0 * N + 8),
    }[form]
    signal = np.exp(2 * (xi - shift)) - np.exp(2 * NOISE)
    found = np.exp(POWER) / np.sqrt(np.maximum(signal, 1e-3 * np.exp(2 * NOISE)))
    share = np.exp(2 * POWER - 2 * np.log(found) - 2 * (xi - shift))  # λ
    return Errors(found / RANGE - 1, np.minimum(found / RANGE / (share * np.sqrt(J)), 10.0))


def range_bound(n_snapshots: int) -> float:
    """Return the Cramér-Rao bound of the range, in parts of it."""
    signal = np.exp(2 * POWER) / RANGE**2
    return float((1 + np.exp(2 * NOISE) / signal) / np.sqrt(4 * n_snapshots))


def position_errors(n_snapshots: int, runs: int, seed: int) -> tuple[dict[str, Errors], Float]:
    """Return errors of the position of a source of known power, by 100 sensors, and the bounds.

    Noise is added to the logarithm, the amplitude or the energy with one variance for all
    sensors, the mean of the true variances. The search starts at the truth.

    Parameters
    ----------
    n_snapshots, runs, seed : int

    Returns
    -------
    errors : dict
        By form: `LOG`, `AMPLITUDE`, `ENERGY`.
    bounds : ndarray, shape (runs,)
        Cramér-Rao bounds, root of the mean squared distance, m.
    """
    from scipy.optimize import least_squares

    rng = np.random.default_rng(seed)
    results: dict[str, list[tuple[Float, Float]]] = {LOG: [], AMPLITUDE: [], ENERGY: []}
    bounds = np.zeros(runs)
    for run in range(runs):
        sensors, truth = in_disc(rng, (N_SENSORS,), DISC), in_disc(rng, (1,), DISC / 2)
        propagation, u = PropagationModel(sensors, log_noise=NOISE), np.array([POWER])
        levels = propagation.levels(u, truth)
        xi = levels.log_sigma + sample_log_envelope(n_snapshots, (N_SENSORS,), rng)
        for power, form in enumerate(results):
            scale = np.exp(power * levels.log_sigma) * max(power, 1) / np.sqrt(4 * n_snapshots)
            std = float(np.sqrt(np.mean(scale**2)))

            fit = least_squares(_residual, truth[0], args=(propagation, u, xi, power, std))
            spread = np.sqrt(np.diag(np.linalg.pinv(fit.jac.T @ fit.jac)))
            results[form].append((fit.x - truth[0], spread))
        G = slopes(levels, propagation.alpha)[:, 1:]
        bounds[run] = np.sqrt(np.trace(np.linalg.inv(4 * n_snapshots * G.T @ G)))
    errors = {form: Errors(*map(np.array, zip(*rows, strict=True)))
              for form, rows in results.items()}  # fmt: skip
    return errors, bounds


def _residual(
    theta: Float, propagation: PropagationModel, u: Float, xi: Float, power: int, std: float
) -> Float:
    """Return the misfit of the logarithm, or of a power of the statistic, in deviations."""
    found = propagation.levels(u, theta[None]).log_sigma
    d = found - xi if power == 0 else np.exp(power * found) - np.exp(power * xi)
    return np.asarray(d / std)


def distribution_distance(form: str, n_snapshots: int) -> float:
    """Return the largest distance of a form's distribution function from that of e.

    Examples
    --------
    >>> [round(distribution_distance(form, 16), 3) for form in FORMS]
    [0.034, 0.017, 0.009, 0.033]
    """
    from scipy.special import gammainc, ndtr

    N = n_snapshots
    e = np.linspace(1e-3, 4, 20_000)
    bias, variance = (float(part) for part in log_envelope_moments(N))
    mean, std = (float(part) for part in envelope_moments(N))
    forms = {
        LOG: np.sqrt(4 * N) * np.log(e),
        EXACT: (np.log(e) - bias) / np.sqrt(variance),
        AMPLITUDE: (e - mean) / std,  # by moment matching
        ENERGY: np.sqrt(N) * (e**2 - 1),
    }
    return float(np.abs(ndtr(forms[form]) - gammainc(N, N * e**2)).max())
