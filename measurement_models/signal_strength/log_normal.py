"""Received signal strength of several sources at sensors, as log-normal readings."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike

from arrivals.entry_names import checked_names
from arrivals.measurement_models.base import MeasurementModel, default_position, locate
from arrivals.measurement_models.signal_strength.arguments import (
    entries,
    per_sensor,
    reading_error,
)
from arrivals.measurement_models.signal_strength.envelope import (
    AveragedEnvelope,
    sample_log_envelope,
)
from arrivals.measurement_models.signal_strength.gains import LogGains
from arrivals.measurement_models.signal_strength.path_loss import (
    Levels,
    PropagationModel,
    check_unit,
    slopes,
)
from arrivals.measurements import real_numbers
from arrivals.typing import Float
from arrivals.validation import LARGEST, constant, count, instance, number, positive, real


@dataclass(frozen=True, eq=False, init=False)
class LogNormalRSS(MeasurementModel):
    """Log readings of signal strength, ξ ~ N(log σ_y, r), σ_y² = Σ e^{2u} R^-α + σ_n².

    Parameters
    ----------
    sensors : array_like, shape (n_sensors, 2)
        Positions of the sensors, m.
    sigma : AveragedEnvelope, float or array_like, shape (n_sensors,)
        Standard deviation of the readings, Np: the shadowing of measured data; or the average of
        N snapshots that makes it 1/(2√N).
    alpha : float
        Loss exponent: received power falls as R^-α. A slope of 10 n dB a decade is α = n.
    log_noise : float or array_like, shape (n_sensors,), optional
        Log amplitude of the noise, Np; without noise if None.
    gains : LogGains
        Known log gains of the sensors and of the paths from the sources.
    r_min : float
        Ranges are not below this, m.
    position : tuple of two int, optional
        Entries of one source's state that are x and y. If None, those that the motion model calls
        so; in states without names (0, 1) of 2 or 3 entries, (0, 2) of more.
    amplitude : int, optional
        Entry of one source's state that is u, its log amplitude at 1 m, Np. If None, the one that
        the motion model calls log_amplitude; without such an entry all u are `log_amplitude`.
    log_amplitude : float
        u of all sources where the state has none, Np.
    n_sources : int
        States hold as many sources, one after the other, with equally many entries each.

    Raises
    ------
    TypeError, ValueError
        If a number is out of range, a shape is wrong, or an entry of the state is named twice.

    Notes
    -----
    Shapes: states (..., n_sources · n), measurements (..., n_sensors). Units: m and Np,
    1 dB = ln(10)/20 Np; `db_to_neper` and `dbm_to_neper` convert. Below `r_min` the level has no
    slope. A missing reading is NaN. A method with positions and log amplitudes apart, such
    as `rss_vb`, calls `levels`.

    References
    ----------
    Cevher, Sankaranarayanan, Chellappa, "Factorized variational approximations for acoustic multi
    source localization", ICASSP 2008, (1)-(3), (9).

    Examples
    --------
    >>> readings = LogNormalRSS([[0.0, 0.0], [60.0, 0.0]], position=(0, 1), amplitude=2)
    >>> readings.h([30.0, 40.0, 9.0]).round(3)
    array([5.088, 5.088])
    >>> readings.H([30.0, 40.0, 9.0]).round(3)
    array([[-0.012, -0.016,  1.   ],
           [ 0.012, -0.016,  1.   ]])
    """

    sensors: Float
    sigma: float | Float | AveragedEnvelope
    alpha: float
    log_noise: float | Float | None
    gains: LogGains
    r_min: float
    position: tuple[int, int] | None
    amplitude: int | None
    log_amplitude: float
    n_sources: int
    renamed: ClassVar[dict[str, str]] = {
        "n_snapshots": "sigma__n_snapshots",
        "exact_moments": "sigma__exact_moments",
        "offsets": "gains__offsets",
        "log_gain": "gains__paths",
    }
    _bias: ClassVar[float]  # of the object, yet no parameters
    _variance: ClassVar[Float]
    _noise: ClassVar[float | Float]

    def __init__(
        self,
        sensors: ArrayLike,
        sigma: ArrayLike | AveragedEnvelope = AveragedEnvelope(),
        *,
        alpha: float = 2.0,
        log_noise: float | ArrayLike | None = None,
        gains: LogGains = LogGains(),
        r_min: float = 1.0,
        position: tuple[int, int] | None = None,
        amplitude: int | None = None,
        log_amplitude: float = 0.0,
        n_sources: int = 1,
    ) -> None:
        places = constant("sensors", sensors)
        if places.shape[1] != 2:
            raise ValueError(f"sensors must have shape (n_sensors, 2); got {places.shape}")
        n = len(places)
        instance("gains", gains, LogGains).check(n)
        own: dict[str, Any] = {
            "sensors": places,
            "alpha": positive("alpha", alpha),
            "log_noise": None if log_noise is None else per_sensor("log_noise", log_noise, n),
            "gains": gains,
            "r_min": positive("r_min", r_min),
            "log_amplitude": number("log_amplitude", log_amplitude),
            "n_sources": count("n_sources", n_sources, maximum=1000),
        }
        if not abs(own["log_amplitude"]) < LARGEST:
            raise ValueError(f"log_amplitude must be finite; got {log_amplitude}")
        own["position"], own["amplitude"] = entries(position, amplitude)
        own["_noise"] = -np.inf if own["log_noise"] is None else own["log_noise"]
        own["sigma"], own["_bias"], own["_variance"] = reading_error(sigma, n)
        for name, value in own.items():
            object.__setattr__(self, name, value)

    @property
    def dim_z(self) -> int:
        """One reading a sensor."""
        return len(self.sensors)

    @property
    def needs(self) -> tuple[str, ...]:
        """X and y, unless `position` is given."""
        return ("x", "y") if self.position is None else ()

    def for_state(self, names: Sequence[str]) -> LogNormalRSS:
        """Return this model with `position` and `amplitude` where the names have them.

        Parameters
        ----------
        names : sequence of str
            `state_names` of the motion model of one source; a TypeError if x or y is missing.

        Returns
        -------
        LogNormalRSS
        """
        names = checked_names(names)
        if not names or self.position is not None:
            return self
        x, y = locate(self, names)
        amplitude = self.amplitude
        if amplitude is None and "log_amplitude" in names:
            amplitude = names.index("log_amplitude")
        return self.replace(position=(x, y), amplitude=amplitude)

    @property
    def variance(self) -> Float:
        """Variances r of the readings, Np², (n_sensors,); not to be written to."""
        return self._variance

    @property
    def R(self) -> Float:
        """Covariance of the readings, Np²: `variance` on the diagonal."""
        return np.diag(self._variance)

    @property
    def propagation(self) -> PropagationModel:
        """Sensors, exponent, noise, floor and gains, for kernels."""
        return PropagationModel(self.sensors, self.alpha, self._noise, self.r_min, self.gains.paths)

    def levels(self, u: ArrayLike, theta: ArrayLike) -> Levels:
        """Return log σ_y and responsibilities of sources (..., n_sources), (..., n_sources, 2)."""
        return self.propagation.levels(
            np.asarray(u, dtype=np.float64), np.asarray(theta, dtype=np.float64)
        )

    def h(self, x: ArrayLike) -> Float:
        """Return log σ_y, with offsets and bias, of states: (..., n) -> (..., n_sensors)."""
        u, theta = self.sources(x)
        return np.asarray(self.levels(u, theta).log_sigma + self.gains.offsets + self._bias)

    def H(self, x: ArrayLike) -> Float:
        """Return the Jacobian of `h` at one state, (n_sensors, n)."""
        x = real("x", x)
        if x.ndim != 1:
            raise ValueError(f"x must have shape (n,); got {x.shape}")
        u, theta = self.sources(x)
        G, K = slopes(self.levels(u, theta), self.alpha), self.n_sources
        H = np.zeros((self.dim_z, K, x.size // K))
        i, j = self._position(x.size // K)
        H[..., i], H[..., j] = G[:, K::2], G[:, K + 1 :: 2]
        if self.amplitude is not None:
            H[..., self.amplitude] = G[:, :K]
        return H.reshape(self.dim_z, x.size)

    def sample(self, x: ArrayLike, rng: np.random.Generator) -> Float:
        """Draw readings of each state: averages of snapshots, or Gaussian with a number `sigma`."""
        u, theta = self.sources(x)
        return self.draw(u, theta, rng)

    def draw(self, u: ArrayLike, theta: ArrayLike, rng: np.random.Generator) -> Float:
        """Draw readings of sources (..., n_sources), (..., n_sources, 2), as `sample` does."""
        instance("rng", rng, np.random.Generator)
        level = self.levels(u, theta).log_sigma + self.gains.offsets
        if isinstance(self.sigma, AveragedEnvelope):
            N = self.sigma.n_snapshots
            return np.asarray(level + sample_log_envelope(N, level.shape, rng))
        return np.asarray(level + self.sigma * rng.standard_normal(level.shape))

    def readings(self, z: ArrayLike) -> Float:
        """Return readings as log σ_y plus noise: checked, without the offsets and the bias.

        Parameters
        ----------
        z : array_like, shape (..., n_sensors)
            Np; NaN, None, masked or infinite where missing.

        Raises
        ------
        TypeError, ValueError
            If the shape is wrong, or a value is in another unit by its size.

        Examples
        --------
        >>> LogNormalRSS([[0.0, 0.0]]).readings([-71.5])
        Traceback (most recent call last):
        ValueError: readings are in neper, within ±40; got -71.5: convert dB and dBm by db_to_neper
        """
        z = real_numbers("z", z)
        if z.ndim == 0 or z.shape[-1] != self.dim_z:
            raise ValueError(f"readings must have shape (..., {self.dim_z}); got {z.shape}")
        xi = z - self.gains.offsets - self._bias
        check_unit(z, xi, np.max(self._noise), np.sqrt(self._variance.max()))
        return np.asarray(xi)

    def sources(self, x: ArrayLike) -> tuple[Float, Float]:
        """Return log amplitudes (..., n_sources) and positions (..., n_sources, 2) of states."""
        x, K = real("x", x), self.n_sources
        n = x.shape[-1] if x.ndim else 0
        position = self._position(n // K)
        least = max(*position, -1 if self.amplitude is None else self.amplitude) + 1
        if n % K or n < K * least:
            column = x.ndim == 2 and x.shape[1] == 1 and len(x) % K == 0 and len(x) >= K * least
            got = f"the column {x.shape}: pass x.ravel()" if column else f"{x.shape}"
            raise ValueError(f"states must have shape (..., {K} n), n at least {least}; got {got}")
        each = x.reshape(*x.shape[:-1], K, n // K)
        theta = each[..., position]
        if self.amplitude is None:
            return np.full(theta.shape[:-1], self.log_amplitude), theta
        return each[..., self.amplitude], theta

    def _position(self, n: int) -> tuple[int, int]:
        """Return the entries that are x and y of a source's state of n entries."""
        if self.position is not None:
            return self.position
        position = default_position(n)
        if self.amplitude in position:
            raise ValueError(
                f"position and amplitude must be different entries; got {position}, "
                f"{self.amplitude}: pass position"
            )
        return position

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, LogNormalRSS):
            return NotImplemented
        return self._content() == other._content()

    def __hash__(self) -> int:
        return hash(self._content())

    def _content(self) -> tuple[object, ...]:
        params = self.get_params(deep=False).values()
        return tuple((v.shape, v.tobytes()) if isinstance(v, np.ndarray) else v for v in params)
