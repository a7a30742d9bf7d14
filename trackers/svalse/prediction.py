"""Motion of components between steps: of points, of a second unknown, of walks that may stop."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import accumulate
from typing import Any

import numpy as np
from numpy.typing import NDArray

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
from arrivals.typing import Bool, Float

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
    tracked: Bool,
    dt: float,
) -> tuple[Float, Float, Float, Float]:
    """Return means, concentrations and modes after a step, and the slopes of the angles."""
    mu, kappa = stacked([each.mu for each in trackers]), stacked([each.kappa for each in trackers])
    modes = stacked([each.modes for each in trackers]).swapaxes(0, 1)
    if is_point_manifold(manifold):
        curved = np.stack([each.curved for each in trackers])
        moved = predicted_points(manifold, motion, mu, kappa, modes, curved, dt)
        return *moved, np.ones(curved.shape)
    slope = angle_manifold("svalse", manifold).slope(np.where(tracked, mu, 0.0))
    return *motion.predict_angles(mu, kappa, modes, dt, slope), slope


def stacked(arrays: Sequence[NDArray[Any]]) -> NDArray[Any]:
    """Return arrays along a new first axis: as `np.stack`, faster for a single one.

    Examples
    --------
    >>> stacked([np.zeros(3), np.ones(3)]).shape, stacked([np.zeros(3)]).shape
    ((2, 3), (1, 3))
    """
    return arrays[0][None].copy() if len(arrays) == 1 else np.stack(arrays)


def joined(arrays: Sequence[NDArray[Any]]) -> NDArray[Any]:
    """Return arrays one behind the other along their first axis; a single one as it is.

    Examples
    --------
    >>> joined([np.zeros(1), np.ones(2)])
    array([0., 1., 1.])
    """
    return arrays[0] if len(arrays) == 1 else np.concatenate(arrays)


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
    both = list(zip(priors, posteriors, strict=True))
    first = [p.tracked.nonzero()[0][: len(q.theta)] for p, q in both]
    n = [len(on) for on in first]
    mu = joined([p.mu[on] for p, on in zip(priors, first, strict=True)])
    prior_kappa = joined([p.kappa[on] for p, on in zip(priors, first, strict=True)])
    prior_variance = 1 / np.maximum(prior_kappa, MIN_KAPPA)
    modes = joined([p.modes.swapaxes(0, 1)[on] for p, on in zip(priors, first, strict=True)])
    modes = walk.renewed(modes.swapaxes(0, 1), prior_variance)
    theta = joined([q.theta[:m] for q, m in zip(posteriors, n, strict=True)])
    active = joined([q.active[:m] for q, m in zip(posteriors, n, strict=True)])
    kappa = joined([_marginal(q)[:m] for q, m in zip(posteriors, n, strict=True)])
    # D = 1/v - 1/v_p;  R = 1/D;  δ = wrap(θ - μ) R/v: the pseudo-measurement and its variance
    D = kappa - 1 / prior_variance
    informed = active & (MIN_INFORMATION / prior_variance < D)
    R = 1 / np.where(informed, D, 1.0)
    shift, variance, updated = walk.update(modes, wrap(theta - mu) * kappa * R, R)
    modes = np.where(informed[:, None], updated, modes)
    theta = wrap(mu + np.where(informed, shift, 0.0))
    variance = np.where(informed, variance, prior_variance)
    ends = accumulate(n)
    parts = [slice(end - m, end) for m, end in zip(n, ends, strict=True)]
    return [
        _merged(posterior, theta[part], variance[part], modes[:, part])
        for posterior, part in zip(posteriors, parts, strict=True)
    ]


def _merged(
    posterior: ComponentPosterior, theta: Float, variance: Float, modes: Float
) -> ComponentPosterior:
    """Return a posterior with other densities of its first components."""
    m = len(theta)
    old_theta, old_kappa = posterior.theta, _marginal(posterior)
    # stated variance: V v_stated/v
    ratio = -2 * np.log(posterior.resultant[:m]) * old_kappa[:m]
    return posterior.changed(
        theta=np.concatenate([theta, old_theta[m:]]),
        kappa=np.concatenate([1 / variance, old_kappa[m:]]),
        resultant=np.concatenate([np.exp(-0.5 * variance * ratio), posterior.resultant[m:]]),
        modes=np.concatenate([modes, np.zeros((3, len(old_kappa) - m, 2))], axis=1),
    )


def _marginal(posterior: ComponentPosterior) -> Float:
    """Return the concentrations of the marginal densities."""
    return posterior.kappa if posterior.marginal_kappa is None else posterior.marginal_kappa
