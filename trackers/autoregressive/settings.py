"""Settings of the regressions and of the noise estimates."""

from __future__ import annotations

from dataclasses import dataclass

from arrivals.parameters import FrozenModel
from arrivals.validation import instance, not_negative, positive


@dataclass(frozen=True)
class RegressionSettings(FrozenModel):
    """Recursive least squares for the directions and for the AR models.

    Parameters
    ----------
    forgetting : float
        λ, forgetting factor per snapshot of the directions, in (0, 1).
    ar_forgetting : float
        λ_a, forgetting factor per snapshot of the AR models, in (0, 1).
    ridge : float
        μ, weight of the present directions, in snapshots at the long-term power of a source.
    ar_ridge : float
        μ_a, weight of the present AR models, in the same unit.
    correction : bool
        Add the covariance of the estimated samples to the regressions. Without it, the plain
        regression of the report, noise biases the directions.

    Raises
    ------
    ValueError
        If a number is out of range.

    Examples
    --------
    >>> RegressionSettings(ridge=5.0).ridge
    5.0
    """

    forgetting: float = 0.98
    ar_forgetting: float = 0.998
    ridge: float = 0.01
    ar_ridge: float = 0.01
    correction: bool = True

    def __post_init__(self) -> None:
        instance("correction", self.correction, bool)
        for name in ("forgetting", "ar_forgetting", "ridge", "ar_ridge"):
            positive(name, getattr(self, name))
        for name in ("forgetting", "ar_forgetting"):
            if not getattr(self, name) < 1:
                raise ValueError(f"{name} must lie in (0, 1); got {getattr(self, name)}")


@dataclass(frozen=True)
class NoiseSettings(FrozenModel):
    """Estimation of the innovation variances of the sources and of the measurement noise.

    Parameters
    ----------
    adapt_process_noise : bool
        Estimate the innovation variances q_k. Otherwise they keep their relation to the
        long-term power of the source, as is right for speech.
    adapt_measurement_noise : bool
        Estimate the measurement noise r.
    r_start : float
        Least r of the first interval, as a fraction of the mean power of the sources, where
        acquisition needs it: many sources, or little noise. 0: none.
    tau : float
        Intervals in which that least r decays by a factor of e.

    Raises
    ------
    ValueError
        If a number is out of range.

    Examples
    --------
    >>> NoiseSettings(r_start=0.3).tau
    25.0
    """

    adapt_process_noise: bool = True
    adapt_measurement_noise: bool = True
    r_start: float = 0.0
    tau: float = 25.0

    def __post_init__(self) -> None:
        for name in ("adapt_process_noise", "adapt_measurement_noise"):
            instance(name, getattr(self, name), bool)
        not_negative("r_start", self.r_start)
        positive("tau", self.tau)
