"""What the coordinate ascents on one look and on several have in common: which components are used.

Equation numbers are those of Park, Meyer and Gerstoft, JASA 153(1), 2023.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass

import numpy as np

from arrivals.measurement_models.manifolds.manifold import Manifold
from arrivals.motion_models.von_mises import wrap
from arrivals.trackers.svalse.components import ComponentPrior
from arrivals.typing import Bool, Complex, Float, Int

CYCLE = 0.2  # of the iterations allowed: a component merged away so often is in a limit cycle


class GreedySupport(ABC):
    """Which of L components are in use: found by flips of one at a time.

    Attributes
    ----------
    active : ndarray of bool, shape (L,)
    """

    active: Bool

    @abstractmethod
    def empty(self) -> None:
        """Set the amplitudes of all components to zero."""

    @abstractmethod
    def gains_from_empty(self) -> None:
        """Reset what `flip` keeps up to date."""

    @abstractmethod
    def deltas(self) -> Float:
        """Return by how much the ELBO (56) would rise if each component were flipped."""

    @abstractmethod
    def flip(self, k: int) -> None:
        """Add component k to the support or remove it."""

    def choose_support(self) -> None:
        """Search the support greedily from the empty one: each flip raises the ELBO by its Δ."""
        self.active[:] = False
        self.empty()
        self.gains_from_empty()
        for _ in range(4 * len(self.active)):
            delta = self.deltas()
            k = int(np.argmax(delta))
            if not delta[k] > 1e-10:
                return
            self.flip(k)

    def evidence(self) -> Float:
        """Return by how much the ELBO would fall without each active component; -inf elsewhere."""
        self.gains_from_empty()
        return np.where(self.active, -self.deltas(), -np.inf)


@dataclass(frozen=True, eq=False)
class InitialSupport:
    """How a step begins: what the prediction says of each of L components.

    Parameters
    ----------
    known : Prediction
        One of nothing in a first step and in VALSE.
    n_carried : int
    rho : ndarray, shape (L,)
        Prior probabilities of being active.
    n_expected : int
        Components among which the power is shared out at first.
    learn_rho : bool
        Whether ρ is learned, since nothing is carried.
    """

    known: ComponentPrior
    n_carried: int
    rho: Float
    n_expected: int
    learn_rho: bool

    @classmethod
    def of(cls, prediction: ComponentPrior | None, L: int) -> InitialSupport:
        """Return the beginning of a step.

        Examples
        --------
        >>> InitialSupport.of(None, 4).rho
        array([0.5, 0.5, 0.5, 0.5])
        """
        half = max(L // 2, 1)
        if prediction is None or len(prediction.mu) == 0:
            noise, none = None if prediction is None else prediction.noise, np.zeros(0)
            known = ComponentPrior(none, none, none, half / L, noise=noise)
            return cls(known, 0, np.full(L, half / L), half, learn_rho=True)
        n = min(len(prediction.mu), L)
        rho = np.concatenate([prediction.existence[:n], np.full(L - n, prediction.birth)])
        return cls(prediction, n, rho, int((rho == rho.max()).sum()), learn_rho=False)


class MergedSupport(GreedySupport):
    """A support in which no two components are too near to each other.

    Attributes
    ----------
    manifold : Manifold
    mean : ndarray, shape (L,)
        ⟨exp(jθ)⟩ of the present densities.
    rho : ndarray, shape (L,)
    learn_rho : bool
    was_active : ndarray of bool, shape (L,)
        In use at the end of an iteration.
    merged : ndarray of int, shape (L,)
        How often each was merged away.
    iterations : int
    """

    manifold: Manifold
    mean: Complex
    rho: Float
    learn_rho: bool
    was_active: Bool
    merged: Int
    iterations: int

    def begin(self, places: InitialSupport) -> None:
        """Keep what a step begins with."""
        L = len(places.rho)
        self.n_carried, self.learn_rho = places.n_carried, places.learn_rho
        self.n_expected = places.n_expected
        self.was_active = np.zeros(L, dtype=np.bool_)
        self.merged = np.zeros(L, dtype=np.int64)
        self.iterations = 0

    @abstractmethod
    def solve(self) -> None:
        """Compute the amplitudes of the support as it is."""

    def learn_odds(self) -> None:
        """Maximise the ELBO over ρ where nothing is predicted."""
        L, K = len(self.rho), int(self.active.sum())
        if self.learn_rho:
            self.rho[:] = min(max(K, 1), L - 1) / L if L > 1 else 0.5

    def merge(self, distance: float) -> None:
        """Switch off every active component nearer than this, rad of direction, to an earlier."""
        on = self.active.nonzero()[0]
        doa = self.manifold.to_doa(np.angle(self.mean[on]))
        near = np.abs(wrap(doa[:, None] - doa)) < distance
        if np.count_nonzero(near) > np.count_nonzero(near.diagonal()):
            for i, row in enumerate(np.triu(near, 1)):
                if self.active[on[i]]:
                    gone = on[row & self.active[on]]
                    self.active[gone] = False
                    self.merged[gone] += 1
            self.solve()
        self.was_active |= self.active

    def cycles(self, max_iterations: int) -> bool:
        """Tell whether the search keeps reviving what merging removes."""
        return bool(self.merged.max() > CYCLE * max_iterations)

    @property
    def age(self) -> Int:
        """0 of components in use, 1 of those that were, -1 of the others, (L,)."""
        return np.where(self.active, 0, np.where(self.was_active, 1, -1))
