"""End of an interval: activity of the sources, measurement noise and long-term powers.

All arrays have leading batch axes, as in `belief`.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from arrivals.trackers.autoregressive.belief import SourceBelief
from arrivals.trackers.autoregressive.interval_filter import FilteredInterval
from arrivals.trackers.autoregressive.regressions import TINY
from arrivals.trackers.autoregressive.settings import NoiseSettings
from arrivals.typing import Bool, Float

MIN_NOISE = 1e-8  # measurement noise over the power of the strongest source
SILENCE = 0.01  # of the long-term powers of all sources: received power below which none is active
MIN_GATED_POWER = 0.5  # of the noise: the gate of a source is a fraction of at least this power
PRIOR_INTERVALS = 20.0  # intervals that the initial powers count for


def finish_interval(
    belief: SourceBelief,
    new: SourceBelief,
    filtered: FilteredInterval,
    noise: NoiseSettings,
    gate: float,
    memory: float,
) -> SourceBelief:
    """Return the belief after an interval: inactive sources keep directions and AR models.

    Parameters
    ----------
    belief, new : SourceBelief
        Before the interval, and with the estimates of the regressions.
    filtered : FilteredInterval
    noise : NoiseSettings
    gate, memory : float
        As in `ARKalmanQRDRLS`.
    """
    n_parts = belief.x.shape[-2]
    current = source_power(filtered.X, belief.doa.shape[-1], n_parts)
    has_data = np.asarray(filtered.decay < 1)[..., None]
    # active_k: mean |s_k|² > γ times the long-term power   (sec. 5)
    minimum = gate * np.maximum(belief.power, MIN_GATED_POWER * belief.r[..., None])
    # in silence there is no information on any source
    received = n_parts * (filtered.y * filtered.y).mean(axis=(-2, -1))
    audible = np.asarray(received > SILENCE * belief.power.sum(axis=-1))[..., None]
    active = ((current > minimum) | (gate == 0)) & has_data & audible
    any_active = np.asarray(active.any(axis=-1))[..., None, None]
    power = np.where(has_data, update_power(belief, current, memory), belief.power)
    scaled_q = belief.q * power / belief.power
    if noise.adapt_process_noise and not active.all():
        new = _with_kept_models(belief, new, active)
    return replace(
        new,
        x=filtered.X[..., -belief.x.shape[-2] :, :],
        P=filtered.P,
        doa=np.where(active, new.doa, belief.doa),
        manifold_factor=np.where(any_active, new.manifold_factor, belief.manifold_factor),
        r=update_noise(belief, filtered) if noise.adapt_measurement_noise else belief.r,
        power=power,
        q=new.q if noise.adapt_process_noise else scaled_q,
        active=active,
        n=belief.n + 1,
    )


def _with_kept_models(belief: SourceBelief, new: SourceBelief, active: Bool) -> SourceBelief:
    """Return a belief with the former AR models of inactive sources."""
    weight = np.where(active.any(axis=-1, keepdims=True), new.ar_weight, belief.ar_weight)
    # their factors in proportion to the weight, which grows for all sources
    scale = np.sqrt(weight / np.where(belief.ar_weight > 0, belief.ar_weight, 1.0))
    kept_factor = scale[..., None, None] * belief.ar_factor
    return replace(
        new,
        a=np.where(active[..., None], new.a, belief.a),
        q=np.where(active, new.q, belief.q),
        ar_factor=np.where(active[..., None, None], new.ar_factor, kept_factor),
        ar_weight=weight,
    )


def source_power(X: Float, n_sources: int, n_parts: int) -> Float:
    """Return the mean power of the samples of each source, (..., n_sources)."""
    signals = X[..., :n_sources]
    return np.asarray((signals * signals).sum(axis=-2) * (n_parts / X.shape[-2]))


def update_noise(belief: SourceBelief, filtered: FilteredInterval) -> Float:
    """Return r <- 0.9 r + 0.1 E|y - A s|² (4.5); r without measurements."""
    new: Float = np.where(np.isnan(filtered.noise), belief.r, filtered.noise)
    minimum = MIN_NOISE * belief.power.max(axis=-1)
    return np.asarray(np.maximum(0.9 * belief.r + 0.1 * new, minimum))


def update_power(belief: SourceBelief, current: Float, memory: float) -> Float:
    """Return the mean power of each source over the last `memory` intervals, pauses included.

    The initial powers count as much as the first `PRIOR_INTERVALS` intervals.
    """
    n = np.minimum(belief.n + PRIOR_INTERVALS, max(memory, PRIOR_INTERVALS))
    power = belief.power + (1 / n)[..., None] * (current - belief.power)
    return np.asarray(np.maximum(power, TINY))
