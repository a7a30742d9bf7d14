"""Von Mises densities on the circle, and a random walk with von Mises steps.

The kernels take arrays with any leading axes. Concentrations run from 0 (uniform) to inf (a point).
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from arrivals.motion_models.base import MotionModel
from arrivals.motion_models.bessel import blurred, concentrations, from_log_ratio, log_bessel_ratio
from arrivals.typing import Complex, Float
from arrivals.validation import count, instance, positive, real, state, time_step


def wrap(angle: ArrayLike) -> Float:
    """Wrap angles into [-π, π); those already inside are returned bit for bit.

    Parameters
    ----------
    angle : array_like, shape (...)
        In rad. Infinite angles become NaN.

    Returns
    -------
    ndarray, shape (...)
        In rad.

    Examples
    --------
    >>> wrap([4.0, -1.0, np.pi]).round(4)
    array([-2.2832, -1.    , -3.1416])
    """
    with np.errstate(invalid="ignore"):
        rest = np.fmod(real("angle", angle), 2 * np.pi)
    return np.asarray(rest - 2 * np.pi * ((rest >= np.pi) * 1.0 - (rest < -np.pi)))


def log_density(theta: ArrayLike, mu: ArrayLike, kappa: ArrayLike) -> Float:
    """Return the logarithm of von Mises densities, ln f(θ; μ, κ).

    Parameters
    ----------
    theta, mu : array_like, shape (...)
        Angles and means, in rad.
    kappa : array_like, shape (...)
        Concentrations, finite and not negative.

    Returns
    -------
    ndarray, shape (...)

    Raises
    ------
    ValueError
        If a concentration is negative.

    References
    ----------
    Park, Meyer, Gerstoft, JASA 153(1), 2023, (3).

    Examples
    --------
    >>> log_density(0.0, 0.0, [0.0, 1e6]).round(4)
    array([-1.8379,  5.9888])
    """
    from scipy.special import i0e

    kappa = concentrations(kappa)
    half = np.sin(0.5 * (real("theta", theta) - real("mu", mu)))
    # cos δ - 1 = -2 sin²(δ/2), so that nothing of the size of κ cancels.
    return np.asarray(-2 * kappa * half * half - np.log(2 * np.pi * i0e(kappa)))


def product(
    mu1: ArrayLike, kappa1: ArrayLike, mu2: ArrayLike, kappa2: ArrayLike
) -> tuple[Float, Float]:
    """Return mean and concentration of products of two von Mises densities: η = η₁ + η₂.

    Parameters
    ----------
    mu1, mu2 : array_like, shape (...)
        Means, in rad.
    kappa1, kappa2 : array_like, shape (...)
        Concentrations, finite.

    Returns
    -------
    mu : ndarray, shape (...)
        In rad, in [-π, π).
    kappa : ndarray, shape (...)

    References
    ----------
    Park, Meyer, Gerstoft, JASA 153(1), 2023, (5), with η = κ exp(jμ).

    Examples
    --------
    >>> product([0.0, 0.0], 3.0, [0.0, np.pi / 2], 4.0)
    (array([0.        , 0.92729522]), array([7., 5.]))
    """
    one, other = (np.exp(1j * real("mu", mu)) for mu in (mu1, mu2))
    eta = real("kappa1", kappa1) * one + real("kappa2", kappa2) * other
    return wrap(np.angle(eta)), np.asarray(np.abs(eta))


def mfold_concentration(kappa: ArrayLike, m: ArrayLike) -> Float:
    """Return the concentration of each mode of f(mθ; κ), an m-fold wrapped density.

    κ̃ = A⁻¹(A(κ)^(1/m²)), which approaches m²κ as κ grows.

    Parameters
    ----------
    kappa : array_like, shape (...)
        Concentrations, not negative.
    m : array_like of int, broadcasting with `kappa`
        Number of modes.

    Returns
    -------
    ndarray, shape (...)

    Raises
    ------
    ValueError
        If a concentration is negative, or `m` is below 1.

    References
    ----------
    Badiu, Hansen, Fleury, IEEE TSP 65(9), 2017; Park, Meyer, Gerstoft, JASA 153(1), 2023, (40) by
    the Gaussian limit I_m/I₀ ≈ (I₁/I₀)^m².

    Examples
    --------
    >>> mfold_concentration([0.0, 2.0, 1e6], 3).round(2)
    array([0.000000e+00, 1.302000e+01, 8.999996e+06])
    """
    modes = real("m", count("m", m) if np.isscalar(m) else m)
    if (modes < 1).any():
        raise ValueError(f"m must be at least 1; got {modes.min()}")
    return from_log_ratio(log_bessel_ratio(kappa) / modes**2)


def mfold_modes(eta: ArrayLike, m: int) -> Complex:
    """Return the parameters of the m densities whose even mixture approximates f(mθ; η).

    η̃_r = κ̃ exp(j(μ + 2πr)/m), r = 0..m-1, with κ̃ from `mfold_concentration`.

    Parameters
    ----------
    eta : array_like of complex, shape (...)
        Parameters η = κ exp(jμ).
    m : int
        Number of modes, at least 1.

    Returns
    -------
    ndarray of complex, shape (..., m)

    References
    ----------
    Park, Meyer, Gerstoft, JASA 153(1), 2023, (39).

    Examples
    --------
    >>> np.angle(mfold_modes(5.0, 2)).round(4)
    array([0.    , 3.1416])
    """
    eta, turns = np.asarray(eta)[..., None], 2 * np.pi * np.arange(count("m", m))
    phase = (np.angle(eta) + turns) / m
    return np.asarray(mfold_concentration(np.abs(eta), m) * np.exp(1j * phase))


@dataclass(frozen=True)
class VonMisesWalk(MotionModel):
    """An angle that takes a von Mises step per unit of time, of one width or of one in direction.

    Parameters
    ----------
    kappa : float, optional
        Concentration of the step; large is slow.
    sigma_doa : float, optional
        Instead, the standard deviation of the step in direction, rad. An angle that turns
        `slope` times as fast as the direction takes steps of the concentration
        (sigma_doa · slope)⁻²; without a slope the angle is the direction.

    Raises
    ------
    ValueError
        If neither or both are given, or the one given is not finite and positive.

    Notes
    -----
    Shapes: states (..., 1). Units: rad, in [-π, π).

    References
    ----------
    Mardia and Jupp, *Directional Statistics*, 2000, sec. 3.5.4; Park, Meyer, Gerstoft, JASA 153(1),
    2023, (61).

    Examples
    --------
    >>> VonMisesWalk(kappa=100.0).Q().round(4)
    array([[0.0101]])
    >>> VonMisesWalk(sigma_doa=0.1).step_concentration([1.0, 0.5])
    array([100., 400.])
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

    def step_concentration(self, slope: ArrayLike = 1.0) -> Float:
        """Return the concentration of the step per unit of time.

        Parameters
        ----------
        slope : array_like, shape (...)
            |dθ/dβ| of an angle θ whose direction is β; not used where `kappa` is given.
        """
        if self.sigma_doa is not None:
            return np.asarray(self.sigma_doa * real("slope", slope)) ** -2
        return np.asarray(self.kappa, dtype=np.float64)

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
        time_step(dt)
        return wrap(state(x, 1))

    def F(self, x: ArrayLike, dt: float = 1.0) -> Float:
        """Return the slope of `f`, [[1]]."""
        return np.eye(1)

    def Q(self, dt: float = 1.0) -> Float:
        """Return the variance of the wrapped normal step of the same A, -2 ln A(κ) dt, in rad²."""
        log_ratio = log_bessel_ratio(self.step_concentration())
        return np.full((1, 1), -2 * log_ratio * time_step(dt))

    def blur(self, kappa: ArrayLike, dt: float = 1.0, slope: ArrayLike = 1.0) -> Float:
        """Return the concentration after a step of densities that had concentration `kappa`.

        The convolution of two von Mises densities, brought back to one by its first moment:
        A(κ') = A(κ) A(κ_step)^dt.

        Parameters
        ----------
        kappa : array_like, shape (...)
            Concentrations, not negative; inf is a known angle.
        dt : float
            Not negative.
        slope : array_like, shape (...)
            As in `step_concentration`.

        Returns
        -------
        ndarray, shape (...)

        Raises
        ------
        ValueError
            If a concentration or `dt` is negative.

        Examples
        --------
        >>> VonMisesWalk(kappa=100.0).blur([0.0, 100.0, np.inf]).round(2)
        array([  0.  ,  50.25, 100.  ])
        """
        return blurred(kappa, self.step_concentration(slope), time_step(dt))

    def sample(self, x: ArrayLike, rng: np.random.Generator, dt: float = 1.0) -> Float:
        """Draw angles after one von Mises step, of concentration A⁻¹(A(κ)^dt)."""
        mean, rng = self.f(x, dt), instance("rng", rng, np.random.Generator)
        return wrap(mean + rng.vonmises(0.0, self.blur(np.inf, dt), mean.shape))
