"""Support of the components: greedy selection, merging, and its initial values.

Equation numbers are those of Park, Meyer and Gerstoft, JASA 153(1), 2023.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass

import numpy as np

from arrivals.measurement_models.manifolds.manifold import AngleManifold
from arrivals.motion_models.von_mises import wrap
from arrivals.trackers.svalse.components import ComponentPrior
from arrivals.typing import Bool, Complex, Float, Int

MIN_GAIN = 1e-10  # nats by which a change of the support must raise the ELBO
MAX_MERGE_FRACTION = 0.2  # of max_iterations: a component merged more often is in a limit cycle


@dataclass(frozen=True, eq=False)
class InitialSupport:
    """Prior of each of L components at the start of a step.

    Parameters
    ----------
    prior : ComponentPrior
        One without components in a first step and in VALSE.
    n_tracked : int
    rho : ndarray, shape (L,)
        Prior probabilities of being active.
    n_expected : float
        Components among which the power is divided at first, K₀.
    estimate_rho : bool
        Whether ρ is estimated: no component is tracked, and `first_existence` is None.
    """

    prior: ComponentPrior
    n_tracked: int
    rho: Float
    n_expected: float
    estimate_rho: bool

    @classmethod
    def from_prior(
        cls, prior: ComponentPrior | None, L: int, first_existence: float | None = None
    ) -> InitialSupport:
        """Return the initial support of a step.

        Parameters
        ----------
        prior : ComponentPrior or None
        L : int
            Number of components.
        first_existence : float, optional
            As in `CoordinateSolver`.

        Examples
        --------
        >>> InitialSupport.from_prior(None, 4).rho
        array([0.5, 0.5, 0.5, 0.5])
        """
        if prior is None or len(prior.mu) == 0:
            # K₀ = ⌊L/2⌋ of the published program; p = 0.5 in section VI.B
            estimated = first_existence is None
            K0 = max(L // 2, 1) if first_existence is None else first_existence * L
            noise, none = None if prior is None else prior.noise, np.zeros(0)
            empty = ComponentPrior(none, none, none, K0 / L, noise=noise)
            return cls(empty, 0, np.full(L, K0 / L), K0, estimate_rho=estimated)
        n = min(len(prior.mu), L)
        rho = np.concatenate([prior.existence[:n], np.full(L - n, prior.birth)])
        return cls(prior, n, rho, int((rho == rho.max()).sum()), estimate_rho=False)


class GreedySupport(ABC):
    """Support found by changes of one component at a time, no two components too near.

    Attributes
    ----------
    manifold : AngleManifold
    active : ndarray of bool, shape (L,)
        The support.
    mean : ndarray, shape (L,)
        ⟨exp(jθ)⟩ of the present densities.
    rho : ndarray, shape (L,)
        Prior probabilities of being active.
    n_tracked, n_expected, estimate_rho
        As in `InitialSupport`.
    was_active : ndarray of bool, shape (L,)
        Active at the end of an iteration.
    merged : ndarray of int, shape (L,)
        How often each was removed by merging.
    iterations : int
    """

    manifold: AngleManifold
    mean: Complex

    def __init__(self, initial: InitialSupport) -> None:
        L = len(initial.rho)
        self.rho = initial.rho
        self.n_tracked, self.n_expected = initial.n_tracked, initial.n_expected
        self.estimate_rho = initial.estimate_rho
        self.active: Bool = np.zeros(L, dtype=np.bool_)
        self.was_active: Bool = np.zeros(L, dtype=np.bool_)
        self.merged: Int = np.zeros(L, dtype=np.int64)
        self.iterations = 0

    @abstractmethod
    def clear(self) -> None:
        """Set the amplitudes of all components to zero."""

    @abstractmethod
    def reset_gains(self) -> None:
        """Recompute the quantities that `flip` updates, for zero amplitudes."""

    @abstractmethod
    def gains(self) -> Float:
        """Return by how much the ELBO (56) would rise if each component were flipped, Δ."""

    @abstractmethod
    def flip(self, k: int) -> None:
        """Add component k to the support or remove it."""

    @abstractmethod
    def update_amplitudes(self) -> None:
        """Compute the amplitudes for the present support, (52) and (53)."""

    def choose_support(self) -> None:
        """Search the support greedily from the empty one: each flip raises the ELBO by its Δ."""
        self.active[:] = False
        self.clear()
        self.reset_gains()
        for _ in range(4 * len(self.active)):
            gains = self.gains()
            k = int(np.argmax(gains))
            if not gains[k] > MIN_GAIN:
                return
            self.flip(k)

    def update_rho(self) -> None:
        """Maximise the ELBO over ρ, one value for all components, if none is tracked."""
        L, K = len(self.rho), int(self.active.sum())
        if self.estimate_rho:
            self.rho[:] = min(max(K, 1), L - 1) / L if L > 1 else 0.5

    def merge(self, distance: float) -> None:
        """Remove every active component nearer than this, rad of direction, to an earlier one."""
        on = self.active.nonzero()[0]
        doa = self.manifold.to_doa(np.angle(self.mean[on]))
        near = np.abs(wrap(doa[:, None] - doa)) < distance
        if np.count_nonzero(near) > np.count_nonzero(near.diagonal()):
            for i, row in enumerate(np.triu(near, 1)):
                if self.active[on[i]]:
                    removed = on[row & self.active[on]]
                    self.active[removed] = False
                    self.merged[removed] += 1
            self.update_amplitudes()
        self.was_active |= self.active

    def is_cycling(self, max_iterations: int) -> bool:
        """Return True if the search keeps reactivating what merging removes."""
        return bool(self.merged.max() > MAX_MERGE_FRACTION * max_iterations)

    def evidence(self) -> Float:
        """Return by how much the ELBO would fall without each active component; -inf elsewhere."""
        self.reset_gains()
        return np.where(self.active, -self.gains(), -np.inf)

    @property
    def age(self) -> Int:
        """0 of active components, 1 of those that were active, -1 of the others, (L,)."""
        return np.where(self.active, 0, np.where(self.was_active, 1, -1))
