"""Random walk of a direction on the circle, with birth and death of its source."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from arrivals.messages import shown
from arrivals.motion_models.base import MotionModel
from arrivals.motion_models.move_stop import MoveStopWalk
from arrivals.motion_models.von_mises import VonMisesWalk, wrap
from arrivals.typing import Bool, Float
from arrivals.validation import instance, not_negative, number, probability, real, time_step

MIN_KAPPA = 1e-9
PAPER_KAPPA = 148.0  # 1.5° at broadside of a half-wavelength line


@dataclass(frozen=True)
class BernoulliVonMises(MotionModel):
    """A von Mises walk of the angle, with birth and death of its source.

    Parameters
    ----------
    kappa : float, optional
        Concentration of the angle's step per unit of time; 148, the paper's, if neither it nor
        `sigma_doa` is given.
    p_activate, p_deactivate : float
        Probabilities, per unit of time, that an inactive source starts and an active one stops.
    sigma_doa : float, optional
        Instead of `kappa`, the standard deviation of the step in direction, rad; see
        `VonMisesWalk`.
    still : float
        Probability, in [0, 1), that a new source stands still; one that moves may stop, and one
        that stands still may move, as `MoveStopWalk` says. 0 for a walk that never stops.
    walk_range : float, optional
        Standard deviation of the step of 1/R per unit of time, 1/m, where sources have a range R;
        None is a tenth of the largest 1/R that the measurement model expects, a fifth where its
        wavefronts are parabolic.

    Raises
    ------
    ValueError
        If `kappa` and `sigma_doa` are both given, one is not finite and positive, or a
        probability lies outside [0, 1], or `still` outside [0, 1).

    Notes
    -----
    Shapes: states (..., 1), the angle alone. Units: rad. The Gaussian interface is that of `walk`.

    References
    ----------
    Park, Meyer, Gerstoft, JASA 153(1), 2023, (11) and (61); the defaults are the paper's.

    Examples
    --------
    >>> model = BernoulliVonMises()
    >>> model.predict_existence([0.0, 0.5, 1.0])
    array([0.1  , 0.425, 0.75 ])
    >>> model.walk
    VonMisesWalk(kappa=148.0, sigma_doa=None)
    """

    kappa: float | None = None
    p_activate: float = 0.10
    p_deactivate: float = 0.25
    sigma_doa: float | None = None
    still: float = 0.0
    walk_range: float | None = None

    def __post_init__(self) -> None:
        self.walk  # noqa: B018  (rejects invalid steps)
        if not 0 <= number("still", self.still) < 1:
            raise ValueError(f"still must lie in [0, 1); got {self.still}")
        if self.walk_range is not None:
            object.__setattr__(self, "walk_range", not_negative("walk_range", self.walk_range))
        probability("p_activate", self.p_activate)
        probability("p_deactivate", self.p_deactivate)

    @cached_property
    def walk(self) -> VonMisesWalk:
        """Motion of the angle."""
        if self.kappa is None and self.sigma_doa is None:
            return VonMisesWalk(PAPER_KAPPA)
        return VonMisesWalk(self.kappa, self.sigma_doa)

    @cached_property
    def move_stop(self) -> MoveStopWalk | None:
        """The two modes of a walk that may stand still; None where `still` is 0."""
        return MoveStopWalk(self.still) if self.still else None

    @property
    def dim_x(self) -> int:
        """One angle."""
        return 1

    @property
    def state_names(self) -> tuple[str, ...]:
        """The name doa."""
        return ("doa",)

    @property
    def angles(self) -> tuple[int, ...]:
        """The only entry of the state."""
        return (0,)

    def f(self, x: ArrayLike, dt: float = 1.0) -> Float:
        """Return the angles, wrapped and unchanged."""
        return self.walk.f(x, dt)

    def F(self, x: ArrayLike, dt: float = 1.0) -> Float:
        """Return the slope of `f`, [[1]]."""
        return self.walk.F(x, dt)

    def Q(self, dt: float = 1.0) -> Float:
        """Return the variance of the angle's step, in rad²."""
        return self.walk.Q(dt)

    def blur(self, kappa: ArrayLike, dt: float = 1.0, slope: ArrayLike = 1.0) -> Float:
        """Return the concentration after a step; see `VonMisesWalk.blur`."""
        return self.walk.blur(kappa, dt, slope)

    def predict_angles(
        self, mu: Float, kappa: Float, modes: Float, dt: float = 1.0, slope: ArrayLike = 1.0
    ) -> tuple[Float, Float, Float]:
        """Predict the densities of angles.

        Parameters
        ----------
        mu, kappa : ndarray, shape (...)
            Von Mises densities; NaN and 0 in unused places.
        modes : ndarray, shape (3, ..., 2)
            Their modes, as in `MoveStopWalk`, which begin anew where they do not have the variance
            1/kappa; not used where `still` is 0.
        dt : float
            Length of the step.
        slope : array_like, shape (...)
            As in `VonMisesWalk.step_concentration`.

        Returns
        -------
        mu, kappa, modes : ndarray
        """
        if self.move_stop is None:
            return mu, self.blur(kappa, dt, slope), modes
        modes = self.move_stop.renewed(modes, 1 / np.maximum(kappa, MIN_KAPPA))
        step_variance = 1 / self.walk.step_concentration(slope)
        shift, variance, modes = self.move_stop.predict(modes, step_variance, dt)
        return wrap(mu + shift), np.where(np.isnan(mu), 0.0, 1 / variance), modes

    def sample(self, x: ArrayLike, rng: np.random.Generator, dt: float = 1.0) -> Float:
        """Draw angles after a step of sources that remain active."""
        return self.walk.sample(x, rng, dt)

    def predict_existence(self, existence: ArrayLike, dt: float = 1.0) -> Float:
        """Return the probability that each source is active after `dt`.

        ρ' = (1 - p_d) ρ + p_a (1 - ρ) for one unit of time, (11); for others the same chain, run
        for that long.

        Parameters
        ----------
        existence : array_like, shape (...)
            Probabilities before the step.
        dt : float
            Not negative.

        Returns
        -------
        ndarray, shape (...)

        Raises
        ------
        ValueError
            If a probability lies outside [0, 1], if `dt` is negative, or if it is not whole while
            the chain alternates (p_activate + p_deactivate > 1) and has no roots.
        """
        existence = real("existence", existence)
        if not ((existence >= 0) & (existence <= 1)).all():
            raise ValueError(f"existence must lie in [0, 1]; got {shown(existence)}")
        p_activate, p_deactivate = self._switching(dt)
        return np.asarray((1 - p_deactivate) * existence + p_activate * (1 - existence))

    def sample_active(self, active: ArrayLike, rng: np.random.Generator, dt: float = 1.0) -> Bool:
        """Draw the activity of sources after `dt` from the present one.

        Parameters
        ----------
        active : array_like of bool, shape (...)
            Which are active now.
        rng : numpy.random.Generator
            Source of random numbers.
        dt : float
            As in `predict_existence`.

        Returns
        -------
        ndarray of bool, shape (...)

        Raises
        ------
        ValueError
            As in `predict_existence`.

        Examples
        --------
        >>> sure = BernoulliVonMises(p_activate=1.0, p_deactivate=0.0)
        >>> sure.sample_active([True, False], np.random.default_rng(0))
        array([ True,  True])
        """
        active = real("active", active)
        if not ((active == 0) | (active == 1)).all():
            raise ValueError(f"active must hold True or False; got {shown(active)}")
        instance("rng", rng, np.random.Generator)
        p_activate, p_deactivate = self._switching(dt)
        return rng.random(active.shape) < np.where(active == 1, 1 - p_deactivate, p_activate)

    def _switching(self, dt: float) -> tuple[float, float]:
        """Return p_activate and p_deactivate over `dt`: the transition matrix to that power."""
        dt = time_step(dt)
        switching = self.p_activate + self.p_deactivate
        if dt == 1.0 or switching == 0.0:
            return self.p_activate, self.p_deactivate
        eigenvalue = 1 - switching
        if eigenvalue < 0 and not dt.is_integer():
            raise ValueError(
                f"dt must be whole where p_activate + p_deactivate exceeds 1; got dt={dt}"
            )
        weight = (1 - eigenvalue**dt) / switching
        return self.p_activate * weight, self.p_deactivate * weight
