"""Settings of the trackers of positions from signal strength."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal, Self

import numpy as np
from numpy.typing import ArrayLike

from arrivals.measurement_models.signal_strength.decibels import NEPER_PER_DB
from arrivals.messages import shown
from arrivals.parameters import FrozenModel
from arrivals.validation import count, not_negative, number, one_of, positive, real

Sweep = Literal["gauss-seidel", "jacobi"]
Refresh = Literal["point", "literal"]
Covariance = Literal["joint", "factor", "modes"]
SensorChoice = Literal["information", "nearest"]
Method = Literal["lm", "bfgs"]


@dataclass(frozen=True)
class AmplitudePrior(FrozenModel):
    """Gaussian prior and random walk of the log amplitudes u of the sources.

    Parameters
    ----------
    mean : float or array_like, shape (n_sources,)
        Mean of u, Np; 80 dB by default.
    variance : float or array_like, shape (n_sources,)
        Variance of u, Np²; (3 dB)² by default.
    drift : float
        Variance that u gains per unit of time, Np²; (0.3 dB)² by default.
    wave_speed : float, optional
        Speed c of the waves, m/s. If given, the amplitude at a sensor has Doppler's factor
        (1 - v/c cos ψ)⁻² of the predicted velocity, β of (1), which the paper leaves out; the
        motion must have a velocity, and the number of sources must not change.

    Raises
    ------
    TypeError, ValueError
        If a number is not finite, a variance is not positive, or the drift is negative.

    Examples
    --------
    >>> AmplitudePrior(mean=[9.2, 9.0], drift=0.0).mean
    (9.2, 9.0)
    """

    mean: ArrayLike = 80 * NEPER_PER_DB
    variance: ArrayLike = (3 * NEPER_PER_DB) ** 2
    drift: float = (0.3 * NEPER_PER_DB) ** 2
    wave_speed: float | None = None

    def __post_init__(self) -> None:
        for name in ("mean", "variance"):
            object.__setattr__(self, name, _frozen(name, getattr(self, name)))
        if not np.all(np.asarray(self.variance) > 0):
            raise ValueError(f"variance must be positive; got {self.variance}")
        not_negative("drift", self.drift)
        if self.wave_speed is not None:
            positive("wave_speed", self.wave_speed)


@dataclass(frozen=True)
class BirthDeath(FrozenModel):
    """Sources that appear and disappear: confirmation and deletion of tracks.

    Parameters
    ----------
    confirm_steps : int
        Number of steps with clear evidence that confirm a new source; the same number of steps
        with clear evidence against a source delete it.

    Raises
    ------
    TypeError, ValueError
        If `confirm_steps` is not a positive whole number.

    Examples
    --------
    >>> BirthDeath(confirm_steps=2).confirm_steps
    2
    """

    confirm_steps: int = 3

    def __post_init__(self) -> None:
        count("confirm_steps", self.confirm_steps)


@dataclass(frozen=True)
class GridSearch(FrozenModel):
    """Grid search for sources whose number or positions are unknown.

    Parameters
    ----------
    max_sources : int
        Largest number of sources where it is unknown.
    area_std : float, optional
        Standard deviation of the prior of a new source's x and y about the centre of the
        sensors, m; that of the sensors' coordinates if None.
    grid_step : float, optional
        Step of the grid, m; a fifth of `area_std` if None.

    Raises
    ------
    TypeError, ValueError
        If a number is not positive.

    Examples
    --------
    >>> GridSearch(max_sources=4).area_std is None
    True
    """

    max_sources: int = 8
    area_std: float | None = None
    grid_step: float | None = None

    def __post_init__(self) -> None:
        count("max_sources", self.max_sources, maximum=1000)
        for name in ("area_std", "grid_step"):
            if getattr(self, name) is not None:
                positive(name, getattr(self, name))


@dataclass(frozen=True)
class VariationalSolver(FrozenModel):
    """Factorized variational Bayes: order, step and end of the iterations.

    Parameters
    ----------
    sweep : {"gauss-seidel", "jacobi"}
        Whether each factor uses the newest means of the others, or all factors use those of the
        previous iteration, as in Algorithm 1 of the paper.
    damping : float, optional
        Fraction of an iteration's step that is taken, in (0, 1]; if None, 1 for "gauss-seidel",
        and for "jacobi" 0.5 below 20 sources and 0.25 from 20 sources.
    refresh : {"point", "literal"}
        "point" keeps the prior fixed and moves the expansion point. "literal" is Algorithm 1 as
        printed: the posterior of an iteration is the prior of the next one, so the data count
        once per iteration. It is meant for comparison only.
    line_search : bool
        Halve a step that decreases the joint posterior; without effect for "literal".
    max_iterations : int
        Largest number of iterations.
    tol_u : float
        Largest change of a log amplitude at convergence, Np.
    tol_theta : float
        Largest change of a coordinate at convergence, m.
    newton_steps : int
        Largest number of Newton steps for a position in one iteration.
    covariance : {"joint", "factor", "modes"}
        Whether covariances are the marginals of Laplace's joint Gaussian; those of the factors,
        which are too small; or the second moments, about the solution, of a mixture of such
        Gaussians at the maxima found from the sigma points of the prior, weighted by their
        evidence, at about three times the computing time. The next step starts from them. Without
        effect on steps that search for sources.
    sensors_used : int, optional
        Number of sensors whose readings are used in a step, chosen by the predicted sources; all
        if None. Steps that search for sources use all.
    sensor_choice : {"information", "nearest"}
        The sensors with the largest expected decrease of entropy, or those nearest to a source.

    Raises
    ------
    TypeError, ValueError
        If a number is out of range, a choice is unknown, or the published form is combined with
        a part that it does not have: `covariance="modes"`, `sensors_used`.

    References
    ----------
    Cevher, Sankaranarayanan, Chellappa, "Factorized variational approximations for acoustic multi
    source localization", ICASSP 2008, Algorithm 1.

    Examples
    --------
    The published form, with half of each step:

    >>> VariationalSolver(sweep="jacobi", refresh="literal", damping=0.5).max_iterations
    30
    """

    sweep: Sweep = "gauss-seidel"
    damping: float | None = None
    refresh: Refresh = "point"
    line_search: bool = True
    max_iterations: int = 30
    tol_u: float = 0.01
    tol_theta: float = 0.5
    newton_steps: int = 5
    covariance: Covariance = "joint"
    sensors_used: int | None = None
    sensor_choice: SensorChoice = "information"

    @classmethod
    def as_printed(cls) -> Self:
        """Return Algorithm 1 of the paper as printed: 30 parallel updates, each the next prior.

        Returns
        -------
        VariationalSolver

        Examples
        --------
        >>> solver = VariationalSolver.as_printed()
        >>> solver.refresh, solver.sweep, solver.damping, solver.covariance
        ('literal', 'jacobi', 1.0, 'factor')
        """
        return cls(
            sweep="jacobi", damping=1.0, refresh="literal", tol_u=0.0, tol_theta=1e-6,
            max_iterations=30, covariance="factor",
        )  # fmt: skip

    def __post_init__(self) -> None:
        one_of("sweep", self.sweep, ("gauss-seidel", "jacobi"))
        if self.damping is not None and not 0 < number("damping", self.damping) <= 1:
            raise ValueError(f"damping must lie in (0, 1]; got {self.damping}")
        one_of("refresh", self.refresh, ("point", "literal"))
        one_of("line_search", self.line_search, (True, False))
        count("max_iterations", self.max_iterations)
        not_negative("tol_u", self.tol_u)
        not_negative("tol_theta", self.tol_theta)
        count("newton_steps", self.newton_steps)
        one_of("covariance", self.covariance, ("joint", "factor", "modes"))
        one_of("sensor_choice", self.sensor_choice, ("information", "nearest"))
        if self.sensors_used is not None:
            count("sensors_used", self.sensors_used)
        if self.refresh == "literal":
            self._check_literal()

    def _check_literal(self) -> None:
        """Raise a ValueError if Algorithm 1 is combined with a part that it does not have."""
        cure = "use refresh='point', the general form"
        if self.covariance == "modes":
            raise ValueError(
                f"covariance must be 'joint' or 'factor' for refresh='literal'; got 'modes': {cure}"
            )
        if self.sensors_used is not None:
            raise ValueError(
                "sensors_used must be None for refresh='literal', which has all sensors; got "
                f"{self.sensors_used}: {cure}"
            )


@dataclass(frozen=True)
class MAPSolver(FrozenModel):
    """Maximum of the joint posterior, or of the likelihood, by scipy's optimizers.

    Parameters
    ----------
    method : {"lm", "bfgs"}
        Levenberg-Marquardt, or Broyden-Fletcher-Goldfarb-Shanno; both with analytic gradients.
    prior : bool
        Whether the prior is part of the cost: the paper calls the maximum of the joint posterior
        ML. Without it the prior's mean is only the starting point, and a source that the readings
        do not determine may diverge.
    tolerance : float
        Relative change of step and cost at convergence.

    Raises
    ------
    TypeError, ValueError
        If the method is unknown or the tolerance is not positive.

    Examples
    --------
    >>> MAPSolver(method="bfgs").prior
    True
    """

    method: Method = "lm"
    prior: bool = True
    tolerance: float = 1e-8

    def __post_init__(self) -> None:
        one_of("method", self.method, ("lm", "bfgs"))
        one_of("prior", self.prior, (True, False))
        positive("tolerance", self.tolerance)


def _frozen(name: str, value: ArrayLike) -> Any:
    """Return a finite number or a tuple of finite numbers."""
    array = real(name, value)
    if array.ndim > 1 or not np.isfinite(array).all():
        raise ValueError(f"{name} must be a finite number or a list of them; got {shown(value)}")
    return tuple(array.tolist()) if array.ndim else float(array)
