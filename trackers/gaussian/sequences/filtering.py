"""Filtering of a whole sequence by a Gaussian filter, with filterpy's arguments and results."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, TypedDict, Unpack

import numpy as np
from numpy.typing import ArrayLike

from arrivals.measurements import real_numbers, rows
from arrivals.trackers.gaussian.arguments import (
    PerStep,
    has_own_steps,
    measurement_vector,
    per_step_values,
)
from arrivals.trackers.gaussian.sequences.linear_steps import LinearSteps
from arrivals.typing import Bool, Float
from arrivals.validation import LARGEST

if TYPE_CHECKING:
    from arrivals.trackers.gaussian.base import GaussianFilter

Beliefs = list[tuple[Float, Float]]


class BatchOptions(TypedDict, total=False):
    """Keyword arguments of `batch_filter` after filterpy's positional ones."""

    saver: Any
    dts: PerStep


def batch_filter(
    self: GaussianFilter,
    zs: Sequence[ArrayLike | None] | Float,
    Fs: PerStep = None,
    Qs: PerStep = None,
    Hs: PerStep = None,
    Rs: PerStep = None,
    Bs: PerStep = None,
    us: PerStep = None,
    update_first: bool = False,
    **options: Unpack[BatchOptions],
) -> tuple[Float, Float, Float, Float]:
    """Filter a sequence, with the arguments and results of filterpy's method.

    Parameters
    ----------
    zs : sequence of array_like
        One measurement for each step; None or NaN where one is missing.
    Fs, Qs, Hs, Rs, Bs, us : sequence, optional
        One matrix or control input for each step; they replace those of the models.
    update_first : bool
        Update, then predict.
    **options
        saver : filterpy.common.Saver, whose `save` is called after each step.
        dts : sequence of float, the lengths of the steps.

    Returns
    -------
    means, covariances, means_prior, covariances_prior : ndarray
        Shapes (n_steps, *x.shape) and (n_steps, n, n).

    Raises
    ------
    ValueError
        If the length of a sequence differs from that of `zs`.
    """
    saver, dts = _saver_and_dts(**options)
    zs = list(rows("zs", zs))
    n_steps, before = len(zs), dict(vars(self))
    replaced = (Fs, Qs, Hs, Rs, Bs, us, dts)
    arguments = [per_step_values(name, values, n_steps) for name, values in zip(
        ("Fs", "Qs", "Hs", "Rs", "Bs", "us", "dts"), replaced, strict=True
    )]  # fmt: skip
    prior: Beliefs = []
    post: Beliefs = []
    try:
        constant = saver is None and not update_first and all(each is None for each in replaced)
        if constant and has_own_steps(self, "linear_steps"):
            prior, post = _filter_linear(self, zs)
        for k in range(len(post), n_steps):
            F, Q, H, R, B, u, dt = (values[k] for values in arguments)
            if update_first:
                self.update(zs[k], R, H)
                post.append((self.x, self.P))
            self.predict(u, dt=1.0 if dt is None else dt, F=F, Q=Q, B=B)
            prior.append((self.x, self.P))
            if not update_first:
                self.update(zs[k], R, H)
                post.append((self.x, self.P))
            if saver is not None:
                saver.save()
    except Exception:
        vars(self).update(before)  # arrays are never written into
        raise
    return *_stack(post, self), *_stack(prior, self)


def _filter_linear(tracker: GaussianFilter, zs: list[ArrayLike | None]) -> tuple[Beliefs, Beliefs]:
    """Filter up to the last measurement that is not missing, without the attributes of each step.

    The steps from there on set them. Nothing is filtered if a belief overflows.
    """
    z = _measurements(zs, tracker.dim_z)
    missing: Bool = np.isnan(z)
    n_missing: list[int] = missing.sum(axis=1).tolist()
    n_steps = max((k for k, n in enumerate(n_missing) if n < tracker.dim_z), default=0)
    prior: Beliefs = []
    post: Beliefs = []
    steps, (x, P), jittered = LinearSteps(tracker, 1.0), tracker.belief(), 0
    for k in range(n_steps):
        entries = missing[k] if n_missing[k] else None
        try:
            covariances = steps.covariances(P, entries)
        except ValueError:  # the steps one by one say which
            return [], []
        predicted, updated = steps.mean(x, z[k], entries, covariances)
        prior.append((predicted, covariances.P))
        if n_missing[k] == z.shape[1]:
            x, P = predicted, covariances.P
        else:
            x, P, jittered = updated, covariances.gain.P, jittered + covariances.gain.jittered
        post.append((x, P))
    if not all(_is_finite(beliefs) for beliefs in (prior, post)):
        return [], []
    if n_steps:
        tracker.set_belief(x, P)
        tracker.jitter_count += jittered
    shape = np.shape(tracker.x)  # (n,) or (n, 1)
    return [(x.reshape(shape), P) for x, P in prior], [(x.reshape(shape), P) for x, P in post]


def _is_finite(beliefs: Beliefs) -> bool:
    parts = zip(*beliefs, strict=True)
    return all(bool(np.abs(np.array(part)).max() < LARGEST) for part in parts)


def _measurements(zs: list[ArrayLike | None], m: int) -> Float:
    """Return measurements as (n_steps, m), NaN where missing."""
    if all(type(z) is np.ndarray and z.shape == (m,) and z.dtype == np.float64 for z in zs):
        return real_numbers("z", np.array(zs).reshape(len(zs), m))
    return np.array([measurement_vector(z, m) for z in zs]).reshape(len(zs), m)


def _saver_and_dts(saver: Any = None, dts: PerStep = None) -> tuple[Any, PerStep]:
    return saver, dts


def _stack(beliefs: list[tuple[Float, Float]], tracker: GaussianFilter) -> tuple[Float, Float]:
    n_steps, n = len(beliefs), tracker.dim_x
    x = np.array([x for x, _ in beliefs], dtype=np.float64)
    P = np.array([P for _, P in beliefs], dtype=np.float64)
    return x.reshape(n_steps, *np.shape(tracker.x)), P.reshape(n_steps, n, n)
