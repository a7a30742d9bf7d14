"""One interval of the AR Kalman filter with QRD-RLS: signals, then manifold, then AR models.

Everything has leading batch axes; see `source_states`.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from arrivals.measurement_models.manifolds.symmetric_line import ArrayManifold
from arrivals.motion_models.companion_form import CompanionLayout
from arrivals.trackers.autoregressive.belief import Settings, SourceBelief
from arrivals.trackers.autoregressive.interval_filter import FilteredInterval, filtered
from arrivals.trackers.autoregressive.regressions import TINY, autoregression, directions
from arrivals.trackers.autoregressive.steady_state import transposed
from arrivals.typing import Float

LEAST_NOISE = 1e-8  # of the largest source's power: the least measurement noise
AUDIBLE = 0.5  # of the noise: a source below the gate's part of that is silent in any case
PRIOR = 20.0  # intervals that the powers at the start count for


def interval(
    s: SourceBelief, y: Float, manifold: ArrayManifold, blocks: CompanionLayout, o: Settings
) -> tuple[SourceBelief, Float]:
    """Return the belief after an interval, and the states after each of its samples.

    Parameters
    ----------
    s : Sources
    y : ndarray, shape (..., n_samples * parts, n_sensors)
        Transformed snapshots, real; NaN where missing.
    manifold : ArrayManifold
    blocks : Blocks
        Lag by lag.
    o : Options

    References
    ----------
    Gu, Chan, Zhu and Swamy, 2013, algorithm 1, with our corrections: states of one lag more, rows
    for the covariance of the states in both regressions, and targets of the regularisation.
    """
    new = s
    for _ in range(o.inner):
        A = transposed(manifold.real_steering(new.doa))
        heard = filtered(s, new, y, A, blocks, o)
        rows, doa = directions(s, heard, A, manifold, o)
        models, weight, a, q = autoregression(s, new, heard, blocks, o)
        new = replace(new, doa=doa, a=a, q=q, rows=rows, models=models, weight=weight)
    return settled(s, new, heard, o), heard.X


def settled(
    s: SourceBelief, new: SourceBelief, heard: FilteredInterval, o: Settings
) -> SourceBelief:
    """Take over the state, hold those sources that are silent, and learn noise and powers."""
    loud = sounding(heard.X, s.doa.shape[-1], s.x.shape[-2])
    something = np.asarray(heard.kept < 1)[..., None]
    least = o.gate * np.maximum(s.power, AUDIBLE * s.r[..., None])
    active = np.logical_and((loud > least) | (o.gate == 0), something)
    anyone = np.asarray(active.any(axis=-1))
    power = np.where(something, learned_power(s, loud, o), s.power)
    return replace(
        new,
        x=heard.X[..., -s.x.shape[-2] :, :],
        P=heard.P,
        doa=np.where(active, new.doa, s.doa),
        rows=np.where(anyone[..., None, None], new.rows, s.rows),
        r=learned_noise(s, heard, o),
        power=power,
        q=new.q if o.adapt_drive else s.q * power / s.power,
        active=active,
        n=s.n + 1,
    )


def sounding(X: Float, n_sources: int, parts: int) -> Float:
    """Return the mean power of each source's samples, (..., n_sources)."""
    signals = X[..., :n_sources]
    return np.asarray((signals * signals).sum(axis=-2) * (parts / X.shape[-2]))


def learned_noise(s: SourceBelief, heard: FilteredInterval, o: Settings) -> Float:
    """Return r <- 0.9 r + 0.1 E|y - A s|², (4.5) of the report's notation."""
    if not o.adapt_noise:
        return s.r
    new: Float = np.where(np.isnan(heard.noise), s.r, heard.noise)
    return np.asarray(np.maximum(0.9 * s.r + 0.1 * new, LEAST_NOISE * s.power.max(axis=-1)))


def learned_power(s: SourceBelief, loud: Float, o: Settings) -> Float:
    """Return each source's mean power over the last `memory` intervals, pauses included.

    What is known at the start counts as much as the first `PRIOR` intervals.
    """
    share = 1 / np.minimum(s.n + PRIOR, max(o.memory, PRIOR))[..., None]
    return np.asarray(np.maximum(s.power + share * (loud - s.power), TINY))
