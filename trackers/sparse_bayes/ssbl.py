"""Sequential sparse Bayesian learning: initial powers from the last step."""

from __future__ import annotations

from typing import ClassVar

from arrivals.measurement_models.array_snapshot import ArraySnapshot
from arrivals.trackers.registry import register
from arrivals.trackers.sparse_bayes.fixed_point import FixedPointSolver, spread_powers
from arrivals.trackers.sparse_bayes.sbl import SBL
from arrivals.typing import Float
from arrivals.validation import count, positive


@register("ssbl")
class SSBL(SBL):
    """Sequential SBL: initial powers are those of the last step, spread over neighbours.

    The initial powers are its only memory: the iteration may leave them, and the noise variance
    starts from `initial_noise` at each step.

    Parameters
    ----------
    measurement : ArraySnapshot
        As in `SBL`.
    n_directions : int
        As in `SBL`.
    threshold : float
        As in `SBL`.
    initial_power : float
        As in `SBL`.
    initial_noise : float
        As in `SBL`.
    max_sources : int, optional
        As in `SBL`.
    solver : FixedPointSolver
        As in `SBL`.
    n_neighbours : int
        Neighbours on the grid, on either side, over which a power spreads from step to step.
    leakage : float
        Fraction of a power that each of them receives; 1/25 in the paper.
    floor : float
        Minimum initial power, relative to the highest, so that a source may appear anywhere.

    Attributes
    ----------
    doa_grid, gamma, start, noise, x, P
        As in `SBL`.

    Notes
    -----
    A step that is missing, or zero, does not change the memory. The time between steps is not
    used. Otherwise as `SBL`.

    References
    ----------
    Park, Meyer and Gerstoft, "Sequential sparse Bayesian learning for time-varying direction of
    arrival", JASA 149(3), 2021.

    Examples
    --------
    >>> import numpy as np
    >>> from arrivals.measurement_models import SensorArray
    >>> model = ArraySnapshot(SensorArray.ula(15, spacing=0.5), wavelength=1.0, noise=1e-3)
    >>> doa = np.deg2rad([[30.0], [30.5], [31.0]])
    >>> run = SSBL(model).run(model.simulate(doa, 1.0, np.random.default_rng(0)))
    >>> np.rad2deg(run.doa[:, 0]).round(1)
    array([30. , 30.5, 31.5])
    """

    renamed: ClassVar[dict[str, str]] = {"reach": "n_neighbours", "share": "leakage"}

    def __init__(
        self,
        measurement: ArraySnapshot,
        *,
        n_directions: int = 361,
        threshold: float = 0.01,
        initial_power: float = 1.0,
        initial_noise: float = 0.1,
        max_sources: int | None = None,
        solver: FixedPointSolver = FixedPointSolver(),  # noqa: B008  (models are immutable)
        n_neighbours: int = 2,
        leakage: float = 0.04,
        floor: float = 1e-3,
    ) -> None:
        self.n_neighbours = count("n_neighbours", n_neighbours, minimum=0)
        self.leakage = positive("leakage", leakage)
        self.floor = positive("floor", floor)
        super().__init__(
            measurement,
            n_directions=n_directions,
            threshold=threshold,
            initial_power=initial_power,
            initial_noise=initial_noise,
            max_sources=max_sources,
            solver=solver,
        )

    def next_start(self) -> Float:
        """Return the powers of the last step with data, spread; equal ones before the first."""
        if self.gamma.shape != (self.n_directions,) or not self.gamma.sum() > 0:
            return super().next_start()
        return spread_powers(self.gamma, self.n_neighbours, self.leakage, self.floor, self.circular)
