"""What all trackers share whose belief is one mean `x` and one covariance `P`."""

from __future__ import annotations

import time
from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from arrivals.trackers.estimates import StateEstimate
from arrivals.trackers.gaussian.arguments import (
    PerStep,
    measurement_vector,
    missing_mask,
    per_step_values,
)
from arrivals.trackers.gaussian.base import FilterBase
from arrivals.trackers.gaussian.circular import difference, wrapped
from arrivals.trackers.gaussian.equations import predict_gaussian, smooth_gaussian
from arrivals.trackers.gaussian.linalg import Inverse, cholesky
from arrivals.trackers.run import Run
from arrivals.typing import Float
from arrivals.validation import positive, real

Smoothed = tuple[Float, Float, Float, Float]


class GaussianFilter(FilterBase):
    """A Gaussian belief, moved and corrected by what its two models look like near it.

    A method of this type says how it makes the models linear: `linearize_motion`,
    `linearize_measurement`. The rest is here, under filterpy's names.

    Parameters
    ----------
    motion : MotionModel
    measurement : MeasurementModel
        Of a state that `motion` moves.
    x : array_like, shape (n,) or (n, 1)
        Mean; it keeps its number of axes. A column makes columns of `y` and `z` too.
    P : array_like, shape (n, n)
        Covariance.

    Attributes
    ----------
    x_prior, P_prior, x_post, P_post : ndarray
        The belief after the last `predict` and the last `update`.
    z, y : ndarray, shape (m,) or (m, 1)
        Last measurement, NaN where it was missing, and its residual, 0 there.
    K, S, SI : ndarray, shapes (n, m), (m, m), (m, m)
        Gain, covariance of the residual and its inverse.
    log_likelihood, mahalanobis : float
        Of the last measurement; 0 if it was missed.
    inv : callable
        Inverts S: `linalg.inverse`, unless another is assigned.
    jitter_count : int
        How often `linalg.JITTER` had to be added to a covariance.

    Raises
    ------
    TypeError
        If a part is no model.
    ValueError
        If the models' states differ, or `x`, `P` do not fit them.
    """

    def batch_filter(
        self,
        zs: Sequence[ArrayLike | None] | Float,
        Fs: PerStep = None,
        Qs: PerStep = None,
        Hs: PerStep = None,
        Rs: PerStep = None,
        Bs: PerStep = None,
        us: PerStep = None,
        update_first: bool = False,
        saver: Any = None,
        dts: PerStep = None,
    ) -> tuple[Float, Float, Float, Float]:
        """Filter a sequence, as filterpy's method of that name does.

        Parameters
        ----------
        zs : sequence of array_like
            One measurement a step; None or NaN where one was missed.
        Fs, Qs, Hs, Rs, Bs, us, dts : sequence, optional
            One for each step, in place of what the models say; `dts` are the steps' lengths.
        update_first : bool
            Update, then predict.
        saver : filterpy.common.Saver, optional
            Its `save` is called after each step.

        Returns
        -------
        means, covariances, means_prior, covariances_prior : ndarray
            Shapes (n_steps, *x.shape) and (n_steps, n, n).

        Raises
        ------
        ValueError
            If a sequence has another length than `zs`.
        """
        n_steps = len(zs)
        given = (per_step_values(name, values, n_steps) for name, values in zip(
            ("Fs", "Qs", "Hs", "Rs", "Bs", "us", "dts"), (Fs, Qs, Hs, Rs, Bs, us, dts), strict=True
        ))  # fmt: skip
        prior, post = [], []
        for z, F, Q, H, R, B, u, dt in zip(zs, *given, strict=True):
            if update_first:
                self.update(z, R, H)
                post.append((self.x, self.P))
            self.predict(u, dt=1.0 if dt is None else dt, F=F, Q=Q, B=B)
            prior.append((self.x, self.P))
            if not update_first:
                self.update(z, R, H)
                post.append((self.x, self.P))
            if saver is not None:
                saver.save()
        return *self._stacked(post), *self._stacked(prior)

    def _stacked(self, beliefs: list[tuple[Float, Float]]) -> tuple[Float, Float]:
        n_steps, n = len(beliefs), self.dim_x
        x = np.array([x for x, _ in beliefs], dtype=np.float64)
        P = np.array([P for _, P in beliefs], dtype=np.float64)
        return x.reshape(n_steps, *np.shape(self.x)), P.reshape(n_steps, n, n)

    def rts_smoother(
        self,
        Xs: ArrayLike,
        Ps: ArrayLike,
        Fs: PerStep = None,
        Qs: PerStep = None,
        inv: Inverse = np.linalg.inv,
        *,
        us: PerStep = None,
        dts: PerStep = None,
    ) -> Smoothed:
        """Smooth what `batch_filter` or `run` gave: Rauch, Tung and Striebel's recursion.

        Parameters
        ----------
        Xs : array_like, shape (n_steps, n) or (n_steps, n, 1)
            Filtered means.
        Ps : array_like, shape (n_steps, n, n)
            Filtered covariances.
        Fs, Qs, us, dts : sequence, optional
            One for each step, as in `batch_filter`; those of step k+1 lead from k to k+1.
        inv : callable
            Inverts predicted covariances.

        Returns
        -------
        x, P, K, Pp : ndarray
            Smoothed means and covariances, gains, and predicted covariances; the last of `K` is
            zero, the last of `Pp` that of `Ps`, as in filterpy.

        Raises
        ------
        ValueError
            If lengths differ.

        References
        ----------
        Särkkä, *Bayesian Filtering and Smoothing*, 2013, (8.6), (9.6) and (9.17).
        """
        means, P = real("Xs", Xs), np.array(real("Ps", Ps))
        n_steps, n = len(means), self.dim_x
        if P.shape != (n_steps, n, n):
            raise ValueError(f"Ps must have shape {(n_steps, n, n)}; got {P.shape}")
        x, Pp, K = means.reshape(n_steps, n).copy(), P.copy(), np.zeros_like(P)
        Fs, Qs = per_step_values("Fs", Fs, n_steps), per_step_values("Qs", Qs, n_steps)
        us, dts = per_step_values("us", us, n_steps), per_step_values("dts", dts, n_steps)
        angles = self.state_motion.angles
        for k in range(n_steps - 2, -1, -1):
            dt = 1.0 if dts[k + 1] is None else dts[k + 1]
            near = self.linearize(x[k], P[k], dt, Fs[k + 1])
            Q = self.state_motion.Q(dt) if Qs[k + 1] is None else self.process_noise(Qs[k + 1])
            Pp[k], _, _ = cholesky(predict_gaussian(P[k], near.jacobian, near.noise(Q)))
            step = self.control_effect(us[k + 1], None)
            x_next = near.mean if step is None else near.mean + step
            K[k] = P[k] @ near.jacobian.T @ inv(Pp[k])
            dx = difference(x[k + 1], x_next, angles)
            x_smooth, P[k] = smooth_gaussian(x[k], P[k], K[k], dx, P[k + 1] - Pp[k])
            x[k] = wrapped(x_smooth, angles)
        return x.reshape(means.shape), P, K, Pp

    def run_batch(
        self, measurements: Iterable[Iterable[ArrayLike | None]], dt: float = 1.0
    ) -> list[Run]:
        """Run independent sequences, each from the present state, as one array program.

        The tracker itself stays as it is. Sequences of unequal lengths are run one by one.

        Parameters
        ----------
        measurements : array_like, shape (n_sequences, n_steps, m), or nested iterables
            NaN or None where one is missing.
        dt : float
            Time between steps.
        """
        positive("dt", dt)
        if not isinstance(measurements, np.ndarray):
            measurements = sequences = [list(sequence) for sequence in measurements]
            if len({len(sequence) for sequence in sequences}) != 1 or not sequences[0]:
                return super().run_batch(sequences, dt)
        started = time.perf_counter()
        xs, Ps = self._filtered(self._block(measurements), dt)
        elapsed = (time.perf_counter() - started) / xs.shape[1]
        steps = dt * np.arange(len(xs), dtype=np.float64)
        n_found = np.full(len(xs), self.dim_x)
        return [
            Run(StateEstimate, {"x": x, "P": P}, x, n_found, steps, elapsed)
            for x, P in zip(xs.swapaxes(0, 1), Ps.swapaxes(0, 1), strict=True)
        ]

    def _block(self, sequences: Iterable[Iterable[ArrayLike | None]]) -> Float:
        """Return sequences as (n_sequences, n_steps, m), NaN where measurements are missing."""
        m = self.dim_z
        if isinstance(sequences, np.ndarray) and sequences.ndim == 3 and sequences.shape[2] == m:
            return real("measurements", sequences)
        return np.array(
            [[measurement_vector(np.nan if z is None else z, m) for z in row] for row in sequences]
        )

    def _filtered(self, zs: Float, dt: float) -> tuple[Float, Float]:
        """Return means (n_steps, n_sequences, n) and covariances of all sequences at once."""
        x, P = self.belief()
        x = np.repeat(x[None], len(zs), axis=0)
        P = np.repeat(P[None], len(zs), axis=0)
        xs, Ps = [], []
        for z in zs.swapaxes(0, 1):
            x, P = self.predict_belief(x, P, dt, None, None)
            found = self.update_belief(x, P, z, missing_mask(z), self.measurement.R)
            x, P = found.x, found.P
            xs.append(x)
            Ps.append(P)
        return np.array(xs), np.array(Ps)
