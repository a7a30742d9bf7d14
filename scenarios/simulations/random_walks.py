"""Sources that move as the motion model says: scenes in which coverage can be read.

Where the motion model is wrong, intervals that are right under the model cover too often or too
rarely; here it is right.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from arrivals.motion_models import BernoulliVonMises
from arrivals.scenarios.registry import register
from arrivals.scenarios.simulations.line_arrays import LineScenario
from arrivals.typing import Bool, Complex, Float
from arrivals.validation import count, positive

MAX_INITIAL, MAX_DIRECTION, MIN_SEPARATION = 65.0, 75.0, 12.0  # degrees


@register("walk")
@dataclass(frozen=True)
class RandomWalks(LineScenario):
    """Sources that take independent normal steps in direction, reflected at ±75 degrees.

    Parameters
    ----------
    n_sources : int
        Number of sources, at most 10; they start at least 12 degrees apart.
    step_deg : float
        Standard deviation of a step, degrees.

    Examples
    --------
    >>> trial = RandomWalks(n_sources=4).sample(np.random.default_rng(0))
    >>> trial.truth.shape, bool(np.abs(np.rad2deg(trial.truth)).max() < 75)
    ((50, 4), True)
    """

    n_sources: int = 1
    step_deg: float = 1.5

    def __post_init__(self) -> None:
        super().__post_init__()
        if count("n_sources", self.n_sources) > 2 * MAX_INITIAL // MIN_SEPARATION:
            raise ValueError(f"n_sources must be at most 10; got {self.n_sources}")
        positive("step_deg", self.step_deg)

    def doa_deg(self) -> Float:
        """Return zeros, (n_steps, n_sources): the directions are drawn."""
        return np.zeros((self.n_steps, self.n_sources))

    def signals(self, rng: np.random.Generator) -> tuple[Float, Complex, Float]:
        """Draw directions, amplitudes at a sensor, and noise variances."""
        walks = self.walks(rng)
        truth, amplitude, noise = super().signals(rng)
        return np.where(np.isnan(truth), np.nan, np.deg2rad(walks)), amplitude, noise

    def walks(self, rng: np.random.Generator) -> Float:
        """Draw the directions, degrees, (n_steps, n_sources)."""
        span = 2 * MAX_INITIAL - MIN_SEPARATION * (self.n_sources - 1)
        offset = MIN_SEPARATION * np.arange(self.n_sources) - MAX_INITIAL
        start = np.sort(rng.uniform(0, span, self.n_sources)) + offset
        steps = self.step_deg * rng.standard_normal((self.n_steps, self.n_sources))
        steps[0] = start
        x = np.cumsum(steps, axis=0)
        # reflection at ±m: a triangle wave
        return np.asarray(np.abs((x - MAX_DIRECTION) % (4 * MAX_DIRECTION) - 2 * MAX_DIRECTION)
                          - MAX_DIRECTION)  # fmt: skip


@register("switch")
@dataclass(frozen=True)
class SwitchingWalks(RandomWalks):
    """Random walks that stop and start by the Bernoulli chain, all active at first.

    Parameters
    ----------
    p_activate, p_deactivate : float
        Probabilities of starting and stopping in a step.

    Examples
    --------
    >>> trial = SwitchingWalks(n_steps=200).sample(np.random.default_rng(0))
    >>> share = float((~np.isnan(trial.truth)).mean())      # 0.1 / (0.1 + 0.25) in the long run
    >>> trial.truth.shape, 0.2 < share < 0.4
    ((200, 6), True)
    """

    n_sources: int = 6
    p_activate: float = 0.1
    p_deactivate: float = 0.25

    def __post_init__(self) -> None:
        super().__post_init__()
        self.chain  # noqa: B018  (rejects probabilities outside [0, 1])

    @property
    def chain(self) -> BernoulliVonMises:
        """The Bernoulli chain."""
        return BernoulliVonMises(None, self.p_activate, self.p_deactivate)

    def active(self, rng: np.random.Generator) -> Bool:
        """Draw the active sources, (n_steps, n_sources)."""
        active = super().active(rng)
        for step in range(1, self.n_steps):
            active[step] = self.chain.sample_active(active[step - 1], rng)
        return active
