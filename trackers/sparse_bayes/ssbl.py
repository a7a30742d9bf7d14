"""Sparse Bayesian learning that starts where the last step ended."""

from __future__ import annotations

from arrivals.measurement_models.array_snapshot import ArraySnapshot
from arrivals.trackers.registry import register
from arrivals.trackers.sparse_bayes.fixed_point import widened
from arrivals.trackers.sparse_bayes.sbl import SBL
from arrivals.typing import Float
from arrivals.validation import count, positive


@register("ssbl")
class SSBL(SBL):
    """Sequential SBL: the powers start from those of the last step, widened.

    Its start is its only memory: the iteration may leave it, and the noise starts anew.

    Parameters
    ----------
    measurement, n_directions, threshold, start_power, start_noise, tolerance, max_iterations
        As in `SBL`.
    max_sources : int, optional
        As in `SBL`.
    reach : int
        Neighbours on the grid, to either side, over which a power spreads from step to step.
    share : float
        What each of them gets of it; the paper's is 1/25.
    floor : float
        Lowest start, in shares of the highest, so that a source may appear anywhere.

    Attributes
    ----------
    doa_grid, gamma, start, noise, x, P
        As in `SBL`.

    Notes
    -----
    A step that was missed, or in which all was silent, leaves the memory as it was. The time
    between steps is not used. Otherwise as `SBL`.

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

    def __init__(
        self,
        measurement: ArraySnapshot,
        *,
        n_directions: int = 361,
        threshold: float = 0.01,
        start_power: float = 1.0,
        start_noise: float = 0.1,
        tolerance: float = 1e-3,
        max_iterations: int = 1000,
        max_sources: int | None = None,
        reach: int = 2,
        share: float = 0.04,
        floor: float = 1e-3,
    ) -> None:
        self.reach = count("reach", reach, least=0)
        self.share = positive("share", share)
        self.floor = positive("floor", floor)
        super().__init__(
            measurement,
            n_directions=n_directions,
            threshold=threshold,
            start_power=start_power,
            start_noise=start_noise,
            tolerance=tolerance,
            max_iterations=max_iterations,
            max_sources=max_sources,
        )

    def next_start(self) -> Float:
        """Return the powers of the last step heard, widened; all alike before the first."""
        if self.gamma.shape != (self.n_directions,) or not self.gamma.sum() > 0:
            return super().next_start()
        return widened(self.gamma, self.reach, self.share, self.floor, self.circular)
