"""Von Mises-Fisher densities on the sphere, and a random walk of a direction with such steps.

A₃(κ) = coth κ - 1/κ, the Langevin function, is the mean resultant length of a density on the sphere
in three dimensions. The kernels take arrays with any leading axes.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from arrivals.motion_models.base import MotionModel
from arrivals.motion_models.bessel import concentrations
from arrivals.typing import Float
from arrivals.validation import instance, positive, state, time_step

_WIDE = 2.0  # below, a continued fraction; above, coth κ - 1/κ cancels no more than one bit
_DEPTH = 14  # terms of the fraction, exact to the last bit up to 2
_NARROW = 0.04  # of 1 - A₃: below, coth κ = 1 to the last bit
TINY = np.finfo(np.float64).tiny


def langevin(kappa: ArrayLike) -> Float:
    """Return the mean resultant length of von Mises-Fisher densities, A₃(κ) = coth κ - 1/κ.

    Parameters
    ----------
    kappa : array_like, shape (...)
        Concentrations, not negative.

    Returns
    -------
    ndarray, shape (...)
        To a few units in the last place.

    Raises
    ------
    ValueError
        If a concentration is negative.

    References
    ----------
    Mardia and Jupp, *Directional Statistics*, 2000, (9.3.9).

    Examples
    --------
    >>> langevin([0.0, 1.0, 50.0, np.inf]).round(6)
    array([0.      , 0.313035, 0.98    , 1.      ])
    """
    return _resultant(concentrations(kappa))[0]


def log_langevin(kappa: ArrayLike) -> Float:
    """Return ln A₃(κ) without loss of digits where A₃ is near 1.

    Steps of a walk multiply A₃, so this is the scale on which spreads add: -ln A₃ is the variance
    along each great circle of a Brownian motion with the same first moment.

    Parameters
    ----------
    kappa : array_like, shape (...)
        Concentrations, not negative.

    Returns
    -------
    ndarray, shape (...)

    Raises
    ------
    ValueError
        If a concentration is negative.

    Examples
    --------
    >>> log_langevin([0.0, 1e12])
    array([   -inf, -1.e-12])
    """
    ratio, rest = _resultant(concentrations(kappa))
    with np.errstate(divide="ignore"):
        return np.asarray(np.where(rest < 0.5, np.log1p(-np.minimum(rest, 0.5)), np.log(ratio)))


def inverse_langevin(log_ratio: ArrayLike) -> Float:
    """Return the concentration κ of a mean resultant length that is given by its logarithm.

    Parameters
    ----------
    log_ratio : array_like, shape (...)
        ln A₃(κ), not positive.

    Returns
    -------
    ndarray, shape (...)
        To a few units in the last place of κ and of `log_ratio`; inf at 0.

    References
    ----------
    The iteration starts from the approximation of Banerjee, Dhillon, Ghosh and Sra, "Clustering on
    the unit hypersphere using von Mises-Fisher distributions", JMLR 6, 2005.

    Examples
    --------
    >>> inverse_langevin(log_langevin([0.0, 1e-6, 3.0, 1e8]))
    array([0.e+00, 1.e-06, 3.e+00, 1.e+08])
    """
    log_ratio = np.asarray(log_ratio, dtype=np.float64)
    ratio, rest = np.exp(log_ratio), -np.expm1(log_ratio)
    # κ ≈ R (3 - R²) / (1 - R²)
    near, wide = np.minimum(ratio, 1 - _NARROW), np.maximum(rest, _NARROW)
    kappa = np.maximum(near * (3 - near * near) / (wide * (1 + near)), TINY)
    for _ in range(4):
        A, v = _resultant(kappa)
        # Newton, A₃' = 1 - A₃² - 2 A₃/κ, on the smaller of A₃ and 1 - A₃
        slope = 1 - A * A - 2 * A / kappa
        kappa = np.maximum(kappa - np.where(wide < 0.5, wide - v, A - near) / slope, TINY)
    kappa = kappa * (ratio > 0)
    with np.errstate(divide="ignore"):
        return np.asarray(np.where(rest < _NARROW, 1 / np.maximum(rest, 0.0), kappa))


def _resultant(kappa: Float) -> tuple[Float, Float]:
    """Return A₃(κ) and 1 - A₃(κ), each with its digits."""
    # A₃ = κ / (3 + κ² / (5 + κ² / (7 + ...)))
    low = np.minimum(kappa, _WIDE)
    square, tail = low * low, np.full_like(low, 2 * _DEPTH + 1)
    for m in range(_DEPTH - 1, 0, -1):
        tail = 2 * m + 1 + square / tail
    ratio = low / tail
    # 1 - A₃ = 1/κ - 2 / (exp 2κ - 1)
    high = np.maximum(kappa, _WIDE)
    rest = 1 / high - 2 / np.expm1(np.minimum(2 * high, 700.0))
    is_low = kappa < _WIDE
    return np.where(is_low, ratio, 1 - rest), np.where(is_low, 1 - ratio, rest)


@dataclass(frozen=True)
class VonMisesFisherWalk(MotionModel):
    """A direction on the sphere that takes a von Mises-Fisher step per unit of time.

    The state is the unit vector to the source, not azimuth and elevation: there the noise is the
    same in all directions, at the zenith, too.

    Parameters
    ----------
    kappa : float, optional
        Concentration of the step; large is slow.
    sigma_doa : float, optional
        Instead, the standard deviation of the step along each great circle, rad: κ = sigma_doa⁻².

    Raises
    ------
    ValueError
        If neither or both are given, or the one given is not finite and positive.

    Notes
    -----
    Shapes: states (..., 3), (cos el cos az, cos el sin az, sin el). `f` brings states of another
    length, such as those after the update of a Gaussian filter, back to one.

    References
    ----------
    Mardia and Jupp, *Directional Statistics*, 2000, sec. 9.3.2.

    Examples
    --------
    >>> walk = VonMisesFisherWalk(kappa=100.0)
    >>> walk.Q().round(4).diagonal(), walk.blur([100.0, np.inf]).round(2)
    (array([0.0101, 0.0101, 0.0101]), array([ 50.25, 100.  ]))
    """

    kappa: float | None = None
    sigma_doa: float | None = None

    def __post_init__(self) -> None:
        for name in ("kappa", "sigma_doa"):
            if getattr(self, name) is not None:
                positive(name, getattr(self, name))
        if (self.kappa is None) == (self.sigma_doa is None):
            raise ValueError(
                "exactly one of kappa and sigma_doa must be given; "
                f"got kappa={self.kappa}, sigma_doa={self.sigma_doa}"
            )

    @property
    def step_concentration(self) -> float:
        """Concentration of the step per unit of time."""
        if self.kappa is not None:
            return float(self.kappa)
        return float(np.clip(np.float64(self.sigma_doa), 1e-150, 1e150) ** -2)

    @property
    def dim_x(self) -> int:
        """Three, the entries of a unit vector."""
        return 3

    @property
    def state_names(self) -> tuple[str, ...]:
        """The names ux, uy and uz."""
        return ("ux", "uy", "uz")

    def f(self, x: ArrayLike, dt: float = 1.0) -> Float:
        """Return the directions, of length one and otherwise unchanged."""
        time_step(dt)
        x = state(x, 3)
        x = x / np.maximum(np.abs(x).max(axis=-1, keepdims=True), TINY)
        return np.asarray(x / np.maximum(np.linalg.norm(x, axis=-1, keepdims=True), TINY))

    def F(self, x: ArrayLike, dt: float = 1.0) -> Float:
        """Return the slope of `f` at one state, (I - n nᵀ) / |x|."""
        x = state(x, 3)
        if x.ndim != 1:
            raise ValueError(f"x must have shape (3,); got {x.shape}")
        n = self.f(x, dt)
        return np.asarray((np.eye(3) - np.outer(n, n)) / max(float(n @ x), TINY))

    def Q(self, dt: float = 1.0) -> Float:
        """Return -ln A₃(κ) dt, the variance along each great circle, times I, in rad².

        Along the direction itself the steps have next to no variance, and a measurement of the
        direction does not depend on it.
        """
        return np.asarray(-log_langevin(self.step_concentration) * time_step(dt) * np.eye(3))

    def blur(self, kappa: ArrayLike, dt: float = 1.0) -> Float:
        """Return the concentration after a step of densities that had concentration `kappa`.

        The first moment of the density after the step is exact: A₃(κ') = A₃(κ) A₃(κ_step)^dt.

        Parameters
        ----------
        kappa : array_like, shape (...)
            Concentrations, not negative; inf is a known direction.
        dt : float
            Not negative.

        Returns
        -------
        ndarray, shape (...)

        Raises
        ------
        ValueError
            If a concentration or `dt` is negative.

        Examples
        --------
        >>> VonMisesFisherWalk(sigma_doa=0.1).blur([0.0, 100.0, np.inf]).round(2)
        array([  0.  ,  50.25, 100.  ])
        """
        step = time_step(dt) * log_langevin(self.step_concentration)
        return inverse_langevin(log_langevin(kappa) + step)

    def sample(self, x: ArrayLike, rng: np.random.Generator, dt: float = 1.0) -> Float:
        """Draw directions after one step, of concentration A₃⁻¹(A₃(κ)^dt)."""
        n, rng = self.f(x, dt), instance("rng", rng, np.random.Generator)
        kappa = np.maximum(self.blur(np.inf, dt), TINY)
        # 1 - cos θ by its inverse distribution function, exact for every κ
        drop = -np.log1p(rng.random(n.shape[:-1]) * np.expm1(-2 * kappa))[..., None] / kappa
        side = rng.standard_normal(n.shape)
        side = side - (side * n).sum(axis=-1, keepdims=True) * n
        side = side / np.maximum(np.linalg.norm(side, axis=-1, keepdims=True), TINY)
        return np.asarray((1 - drop) * n + np.sqrt(drop * (2 - drop)) * side)
