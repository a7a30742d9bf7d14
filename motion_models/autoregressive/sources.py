"""Autoregressive models of the samples of several sources."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from arrivals.messages import shown
from arrivals.motion_models.autoregressive.companion_form import (
    CompanionLayout,
    companion_layout,
    pole_radius,
    solve_lyapunov,
)
from arrivals.motion_models.base import LinearMotionModel
from arrivals.motion_models.combined import block_diagonal
from arrivals.typing import Complex, Float
from arrivals.validation import items, one_of, positive, real, state, time_step


@dataclass(frozen=True)
class AutoregressiveSources(LinearMotionModel):
    """Autoregressive sources: each sample is a weighted sum of earlier ones plus white noise.

    s_k(j) = Σ_i a_ki s_k(j-i) + v_k(j). The state of source k is [s_k(j), ..., s_k(j-p_k)]: one
    lag more than the order, so that the covariance of a filter contains those between a sample
    and all samples that it depends on.

    Parameters
    ----------
    coefficients : sequence of sequences of float
        a_k of each source; orders may differ.
    noise : float or sequence of float
        q_k, innovation variance: the variance of v_k, of both parts together for complex sources.
    real_valued : bool
        True for real sources (speech), False for complex ones with independent parts.

    Raises
    ------
    ValueError
        If a source or a coefficient is missing, a model is unstable, or a variance not positive.

    Notes
    -----
    Shapes: states (..., dim_x), real: source by source for real sources, [Re; Im] of that for
    complex ones. `complex_state` and `signals` give the complex view. Steps are one sample long.

    References
    ----------
    Gu, Chan, Zhu and Swamy, IEEE TCAS-II 60(1), 2013. The additional lag: ours.

    Examples
    --------
    >>> speech = AutoregressiveSources([[0.9], [1.37, -0.52]], [0.19, 0.14], real_valued=True)
    >>> speech.orders, speech.dim_x
    ((1, 2), 5)
    >>> speech.power.round(1)
    array([1., 1.])
    >>> speech.f([1.0, 0.0, 1.0, 0.0, 0.0])
    array([0.9 , 1.  , 1.37, 1.  , 0.  ])
    """

    coefficients: Sequence[Sequence[float] | Float] | Float
    noise: float | Sequence[float] | Float = 1.0
    real_valued: bool = False

    def __post_init__(self) -> None:
        rows = tuple(
            tuple(real(f"coefficients of source {k}", row).ravel().tolist())
            for k, row in enumerate(items("coefficients", self.coefficients))
        )
        if not rows or not all(rows):
            raise ValueError(
                "coefficients must be one list of at least one number for each source; "
                f"got {shown(self.coefficients)}"
            )
        for k, row in enumerate(rows):
            got = shown(list(row))
            if not np.isfinite(row).all():
                raise ValueError(
                    f"coefficients of source {k} must be finite; got {shown(list(row))}"
                )
            largest = float(pole_radius(np.array(row)))
            if not largest < 1:
                raise ValueError(
                    f"coefficients of source {k} must be stable, all poles inside the unit "
                    f"circle; got {got}, unstable with a pole at the radius {largest:.6g}"
                )
        noise = real("noise", self.noise)
        if noise.shape not in ((), (len(rows),)):
            got = shown(self.noise)
            raise ValueError(f"noise must be 1 or {len(rows)} numbers, one a source; got {got}")
        noise = np.broadcast_to(noise, len(rows))
        object.__setattr__(self, "coefficients", rows)
        object.__setattr__(self, "noise", tuple(positive("noise", q) for q in noise.tolist()))
        object.__setattr__(
            self, "real_valued", bool(one_of("real_valued", self.real_valued, (False, True)))
        )

    @property
    def orders(self) -> tuple[int, ...]:
        """Orders p_k of the sources."""
        return tuple(len(row) for row in self.coefficients)

    @property
    def n_sources(self) -> int:
        """Number of sources."""
        return len(self.coefficients)

    @property
    def layout(self) -> CompanionLayout:
        """Indices of the lags in the state of real sources."""
        return companion_layout(self.orders)

    @property
    def n_parts(self) -> int:
        """Number of real parts of a sample: 1 for real sources, 2 for complex ones."""
        return 1 if self.real_valued else 2

    @property
    def dim_x(self) -> int:
        """Number of lags of all sources, twice that for complex ones."""
        return self.n_parts * self.layout.dim

    @property
    def state_names(self) -> tuple[str, ...]:
        """source_0_lag_0, ...; with _re and _im of complex sources."""
        names = [""] * self.layout.dim
        for k, (order, lags) in enumerate(zip(self.orders, self.layout.lags, strict=True)):
            for i in range(order + 1):
                names[lags[i]] = f"source_{k}_lag_{i}"
        if self.real_valued:
            return tuple(names)
        return tuple(f"{name}_{part}" for part in ("re", "im") for name in names)

    @property
    def coefficient_matrix(self) -> Float:
        """Coefficients, (n_sources, largest order), zero beyond the order of a source."""
        table = np.zeros((self.n_sources, max(self.orders)))
        for row, own in zip(table, self.coefficients, strict=True):
            row[: len(own)] = own
        return table

    @property
    def power(self) -> Float:
        """Stationary variance of each source, (n_sources,)."""
        P = self.stationary_covariance()
        n = self.layout.dim
        return np.asarray(self.n_parts * P[:n, :n].diagonal()[self.layout.first])

    def F(self, x: ArrayLike | None = None, dt: float = 1.0) -> Float:
        """Return the block companion matrix, (dim_x, dim_x), the same for every state."""
        _one_sample(dt)
        return self._each_part(self.layout.transition(self.coefficient_matrix))

    def Q(self, dt: float = 1.0) -> Float:
        """Return the process noise: q_k at the current samples, half in each complex part."""
        _one_sample(dt)
        return self._each_part(self.layout.process_noise(np.array(self.noise)) / self.n_parts)

    def stationary_covariance(self) -> Float:
        """Return the stationary covariance of the state, (dim_x, dim_x)."""
        return solve_lyapunov(self.F(), self.Q())

    def complex_state(self, x: ArrayLike) -> Complex:
        """Return states (..., dim_x) as complex ones: (..., dim_x / 2), or (..., dim_x) if real."""
        x = state(x, self.dim_x)
        if self.real_valued:
            return x.astype(np.complex128)
        n = self.layout.dim
        return np.asarray(x[..., :n] + 1j * x[..., n:])

    def signals(self, x: ArrayLike) -> Complex:
        """Return the current samples of states: (..., dim_x) -> (..., n_sources).

        Examples
        --------
        >>> AutoregressiveSources([[0.9], [0.5]]).signals([1.0, 0, 2.0, 0, 0.5, 0, -1.0, 0])
        array([1.+0.5j, 2.-1.j ])
        """
        return np.asarray(self.complex_state(x)[..., self.layout.first])

    def scaled(self, power: ArrayLike) -> AutoregressiveSources:
        """Return sources of the same spectra with other powers, a number or (n_sources,).

        Examples
        --------
        >>> AutoregressiveSources([[0.6]]).scaled(2.0).power.round(12)
        array([2.])
        """
        power = real("power", power)
        if power.shape not in ((), (self.n_sources,)):
            got = f"shape {power.shape}"
            raise ValueError(
                f"power must be 1 or {self.n_sources} numbers, one a source; got {got}"
            )
        noise = np.array(self.noise) * (power / self.power)
        return self.replace(noise=noise.tolist())

    def _each_part(self, matrix: Float) -> Float:
        return matrix if self.real_valued else block_diagonal(matrix, matrix)


def _one_sample(dt: float) -> None:
    if time_step(dt) != 1:
        raise ValueError(f"dt must be 1, one sample, for autoregressive sources; got {dt}")
