"""Settings of the regressions and of the noise estimates."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, get_args

from arrivals.parameters import FrozenModel
from arrivals.validation import instance, not_negative, one_of, positive

Angles = Literal["atan2", "ratio"]
Pairs = Literal["fit", "mean", "inner"]
Rows = Literal["directions", "estimated"]


@dataclass(frozen=True)
class RegressionSettings(FrozenModel):
    r"""Recursive least squares for the directions and for the AR models.

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
    angles : {"atan2", "ratio"}
        Phases of a pair from its rows. "ratio", literally (7): the arctangent of their quotient,
        unique only for d_m \|sin θ\| < 1/4 wavelength; atan2 is up to 1/2.
    pairs : {"fit", "mean", "inner"}
        Directions from the phases of all pairs: by a least-squares fit of sin θ, which resolves
        the whole turns of pairs farther out than half a wavelength; by the mean of the directions
        of each pair, line 15 of Algorithm 1; or by the inner pair alone, "skip averaging".
    rows : {"directions", "estimated"}
        Rows of the manifold of the next interval: those of the directions, or the estimated rows
        themselves, which any mixture of the sources fits as well.
    huber : float, optional
        M-estimation in both regressions: a sample whose error is beyond this many standard
        deviations of the noise, or of the innovations, has less weight. None: least squares.
        Innovation variances are then too small where there are no outliers, at 1.5 by an eighth.

    Raises
    ------
    ValueError
        If a number is out of range or a form is unknown.

    Notes
    -----
    The tracker states deviations only with the default `angles`, `pairs`, `rows` and `huber`: they
    are derived for these; else they are NaN. The default follows the report but for `correction`.

    References
    ----------
    Magakian, report of 25 April 2024, equation (7) and Algorithm 1. M-estimation: Zhang, Chan, Zhou
    and Hu, ISCAS 2009, 1193-1196, Table I.

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
    angles: Angles = "atan2"
    pairs: Pairs = "fit"
    rows: Rows = "directions"
    huber: float | None = None

    def __post_init__(self) -> None:
        instance("correction", self.correction, bool)
        one_of("angles", self.angles, get_args(Angles))
        one_of("pairs", self.pairs, get_args(Pairs))
        one_of("rows", self.rows, get_args(Rows))
        if self.huber is not None:
            positive("huber", self.huber)
        for name in ("forgetting", "ar_forgetting", "ridge", "ar_ridge"):
            positive(name, getattr(self, name))
        for name in ("forgetting", "ar_forgetting"):
            if not getattr(self, name) < 1:
                raise ValueError(f"{name} must lie in (0, 1); got {getattr(self, name)}")

    @property
    def states_deviations(self) -> bool:
        """True if deviations of the directions are derived for this form of the regression."""
        literal = self.angles, self.pairs, self.rows, self.huber
        return literal == ("atan2", "fit", "directions", None)


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
