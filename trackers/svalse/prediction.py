"""Motion of components between steps: of points, of a second unknown, of walks that may stop."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from arrivals.measurement_models.manifolds.manifold import (
    Manifold,
    angle_manifold,
    is_angle_manifold,
    is_point_manifold,
)
from arrivals.motion_models.bernoulli_von_mises import MIN_KAPPA, BernoulliVonMises
from arrivals.motion_models.move_stop import MoveStopWalk
from arrivals.motion_models.von_mises import wrap
from arrivals.trackers.svalse.components import ComponentPosterior, TrackedComponents
from arrivals.trackers.svalse.point_prediction import (
    MIN_INFORMATION,
    predicted_points,
    with_point_modes,
)
from arrivals.typing import Float

DEFAULT_MOTION = BernoulliVonMises(sigma_doa=np.deg2rad(1.5), still=0.1)


def motion_on(manifold: Manifold, motion: BernoulliVonMises, memory: str) -> BernoulliVonMises:
    """Return the motion model for a memory: the default one of whole densities never stops.

    Raises
    ------
    ValueError
        If the memory of whole densities is not supported, or a walk that may stop with it.
    """
    if memory != "posterior":
        return motion
    if not is_angle_manifold(manifold):
        raise ValueError(f"memory must be 'von_mises' with two unknowns a source; got {memory!r}")
    if motion is DEFAULT_MOTION:
        return motion.replace(still=0.0)
    if motion.still:
        raise ValueError(f'still must be 0 where memory is "posterior"; got {motion.still}')
    return motion


def n_moments(manifold: Manifold, motion: BernoulliVonMises) -> int:
    """Return the number of moments that a density has after a step of the motion model."""
    angles = angle_manifold("a memory of whole densities", manifold)
    slowest = angles.slope(angles.from_doa(np.pi / 2))
    return int(7 * np.sqrt(float(motion.blur(np.inf, 1.0, slowest)))) + 8


def nuisance_weights(manifold: Manifold) -> Float:
    """Return the prior of the values of a second parameter; [1.0] as a rule."""
    return manifold.nuisance_weights if is_angle_manifold(manifold) else np.ones(1)


def same_unknowns(one: Manifold, other: Manifold) -> bool:
    """Return True if components of one manifold mean the same in another.

    Points have the units of their array; angles do not depend on it.
    """
    if is_point_manifold(one) or is_point_manifold(other):
        return one is other
    weights = nuisance_weights(one), nuisance_weights(other)
    return one.n_bins == other.n_bins and len(weights[0]) == len(weights[1])


def predicted_components(
    manifold: Manifold,
    motion: BernoulliVonMises,
    trackers: Sequence[TrackedComponents],
    dt: float,
) -> tuple[Float, Float, Float, Float]:
    """Return means, concentrations and modes after a step, and the slopes of the angles."""
    mu, kappa = (np.stack([getattr(each, name) for each in trackers]) for name in ("mu", "kappa"))
    modes = np.stack([each.modes for each in trackers], axis=1)
    tracked = np.stack([each.tracked for each in trackers])
    if is_point_manifold(manifold):
        curved = np.stack([each.curved for each in trackers])
        moved = predicted_points(manifold, motion, mu, kappa, modes, curved, dt)
        return *moved, np.ones(curved.shape)
    slope = angle_manifold("svalse", manifold).slope(np.where(tracked, mu, 0.0))
    return *motion.predict_angles(mu, kappa, modes, dt, slope), slope


def drifted(nuisance: Float) -> Float:
    """Return densities (..., n) of a second unknown after a step, on its grid.

    It stays with probability 0.9, and else goes to a neighbour; a trace is anywhere.

    Examples
    --------
    >>> drifted(np.array([0.0, 1.0, 0.0])).round(4)
    array([0.05  , 0.8999, 0.05  ])
    """
    left, right = nuisance[..., :1], nuisance[..., -1:]
    wide = np.concatenate([left, nuisance, right], axis=-1)
    shifted = 0.9 * nuisance + 0.05 * (wide[..., :-2] + wide[..., 2:])
    return np.asarray((1 - 1e-4) * shifted + 1e-4 / nuisance.shape[-1])


def n_mode_rows(manifold: Manifold) -> int:
    """Return the rows of `modes`: offset, variance and weight, or their triangles."""
    d = manifold.n_unknowns
    return d + d * (d + 1) // 2 + 1


def with_modes(
    walk: MoveStopWalk | None,
    manifold: Manifold,
    priors: Sequence[TrackedComponents],
    posteriors: Sequence[ComponentPosterior],
) -> Sequence[ComponentPosterior]:
    """Return posteriors in which the modes of the walk have been updated, in one array program.

    The data's part of each posterior, relative to its prior, is a measurement of the angle.

    Parameters
    ----------
    walk : MoveStopWalk or None
        None if it never stops.
    manifold : Manifold
        Of all sensors.
    priors : sequence of TrackedComponents
        Predicted components, one record for each posterior.
    posteriors : sequence of ComponentPosterior

    Returns
    -------
    list of ComponentPosterior
        With `modes`, and the angles and variances of the mixtures.
    """
    if walk is None:
        return posteriors
    if is_point_manifold(manifold):
        return with_point_modes(walk, manifold, priors, posteriors)
    n = [min(int(p.tracked.sum()), len(q.theta)) for p, q in zip(priors, posteriors, strict=True)]
    first = [np.flatnonzero(p.tracked)[:m] for p, m in zip(priors, n, strict=True)]
    mu = np.concatenate([p.mu[on] for p, on in zip(priors, first, strict=True)])
    prior_kappa = np.concatenate([p.kappa[on] for p, on in zip(priors, first, strict=True)])
    prior_variance = 1 / np.maximum(prior_kappa, MIN_KAPPA)
    modes = np.concatenate([p.modes[:, on] for p, on in zip(priors, first, strict=True)], axis=1)
    modes = walk.renewed(modes, prior_variance)
    theta, active = (
        np.concatenate([getattr(q, name)[:m] for q, m in zip(posteriors, n, strict=True)])
        for name in ("theta", "active")
    )
    kappa = np.concatenate([_marginal(q)[:m] for q, m in zip(posteriors, n, strict=True)])
    # D = 1/v - 1/v_p;  R = 1/D;  δ = wrap(θ - μ) R/v: the pseudo-measurement and its variance
    D = kappa - 1 / prior_variance
    informed = active & (MIN_INFORMATION / prior_variance < D)
    R = 1 / np.where(informed, D, 1.0)
    shift, variance, updated = walk.update(modes, wrap(theta - mu) * kappa * R, R)
    modes = np.where(informed[:, None], updated, modes)
    theta = wrap(mu + np.where(informed, shift, 0.0))
    variance = np.where(informed, variance, prior_variance)
    ends = np.cumsum(n)[:-1]
    parts = zip(
        posteriors,
        np.split(theta, ends),
        np.split(variance, ends),
        np.split(modes, ends, axis=1),
        strict=True,
    )
    return [_merged(*part) for part in parts]


def _merged(
    posterior: ComponentPosterior, theta: Float, variance: Float, modes: Float
) -> ComponentPosterior:
    """Return a posterior with other densities of its first components."""
    m = len(theta)
    old_theta, old_kappa = posterior.theta, _marginal(posterior)
    # stated variance: V v_stated/v
    ratio = -2 * np.log(posterior.resultant[:m]) * old_kappa[:m]
    return replace(
        posterior,
        theta=np.concatenate([theta, old_theta[m:]]),
        kappa=np.concatenate([1 / variance, old_kappa[m:]]),
        resultant=np.concatenate([np.exp(-0.5 * variance * ratio), posterior.resultant[m:]]),
        modes=np.concatenate([modes, np.zeros((3, len(old_kappa) - m, 2))], axis=1),
    )


def _marginal(posterior: ComponentPosterior) -> Float:
    """Return the concentrations of the marginal densities."""
    return posterior.kappa if posterior.marginal_kappa is None else posterior.marginal_kappa
