"""What the subspace methods share: how many sources, which subspace, which directions."""

from __future__ import annotations

from abc import abstractmethod
from typing import Any, Generic, Literal, NamedTuple, Protocol, TypeAlias, TypeVar

import numpy as np
from numpy.typing import ArrayLike

from arrivals.measurement_models.array_snapshot import ArraySnapshot
from arrivals.measurement_models.arrays.sensor_array import SensorArray
from arrivals.measurement_models.manifolds.manifold import UniformLineManifold
from arrivals.trackers.base import is_missing
from arrivals.trackers.beamforming.covariance import RunningCovariance, smoothed
from arrivals.trackers.direction_tracker import DirectionTracker
from arrivals.trackers.estimates import DirectionEstimate
from arrivals.trackers.subspace.source_number import number_of_sources
from arrivals.typing import Bool, Complex, Float
from arrivals.validation import count, instance, not_negative, one_of, probability

NumberOfSources: TypeAlias = int | Literal["aic", "mdl"] | None
FADED = 1e-3  # a sensor of less weight, relative to the best, counts as not heard


class Subspaces(NamedTuple):
    """Orthonormal bases of what the sources span, (..., n, K), and of the rest, (..., n, n - K)."""

    signal: Complex
    noise: Complex


class Finder(Protocol):
    """Finds directions from subspaces."""

    @property
    def limit(self) -> int:
        """Number of sources that can be found at most."""

    def directions(self, found: Subspaces) -> Float:
        """Return directions, rad, of as many sources as the signal subspace has dimensions."""


F = TypeVar("F", bound=Finder)


def on_grid(model: ArraySnapshot) -> UniformLineManifold:
    """Return the array as a line on a uniform grid.

    Raises
    ------
    ValueError
        If it is none, or its grid is wider than half the wavelength.
    """
    line, limit = model.manifold(), model.array.alias_limit
    if limit is not None and model.wavelengths[0] < limit * (1 - 1e-6):
        raise ValueError(
            f"the wavelength, {model.wavelengths[0]:.6g} m, is below the array's alias limit of "
            f"two grid spacings, {limit:.6g} m: this method would be ambiguous"
        )
    if not isinstance(line, UniformLineManifold):
        raise ValueError(
            "this method needs a line of sensors on a uniform grid (gaps are allowed); "
            f"this array has {model.array.n_sensors} sensors in {model.array.dim} dimension(s)"
        )
    return line


def fitted(A: Complex, z: Complex) -> Complex:
    """Return the least-squares amplitudes of steering vectors, rows of A, in a snapshot.

    Sensors that are NaN are left out; waves that cannot be told apart share alike.

    Examples
    --------
    >>> fitted(np.array([[1.0, 1.0, 1.0], [1.0, -1.0, 1.0]]), np.array([5.0, 1.0, np.nan])).real
    array([3., 2.])
    """
    heard = ~np.isnan(z)
    A, y = (A, z) if heard.all() else (A[:, heard], z[heard])
    G = A.conj() @ A.T
    G.flat[:: len(A) + 1] += 1e-12 * len(y)
    return np.linalg.solve(G, A.conj() @ y).astype(np.complex128)


class SubspaceTracker(DirectionTracker, Generic[F]):
    """Directions of sources that span less than all sensors could hear.

    Subclasses say how a subspace is learned (`_learn`, `_decomposed`) and how directions are
    found from it (`_finder`).

    Attributes
    ----------
    total, squares : float
        Sum of the weights of the snapshots heard, and of their squares.
    n_heard : int
        Snapshots heard.
    """

    measurement: ArraySnapshot
    n_sources: NumberOfSources
    max_sources: int | None
    forgetting: float
    interval: int

    def _set_up(self, **params: Any) -> None:
        """Keep the parameters under their names, checked; know nothing."""
        for name, value in params.items():
            setattr(self, name, value)
        model = instance("measurement", self.measurement, ArraySnapshot)
        model.plain_wavelength("a subspace method")
        self.forgetting = probability("forgetting", self.forgetting)
        count("interval", self.interval)
        if self.max_sources is not None:
            count("max_sources", self.max_sources)
        if isinstance(self.n_sources, str):
            one_of("n_sources", self.n_sources, ("aic", "mdl"))
        elif self.n_sources is not None:
            self.n_sources = count("n_sources", self.n_sources)
        self._check_limit()
        self.total, self.squares, self.n_heard = 0.0, 0.0, 0
        self.report([])

    def _check_limit(self) -> None:
        limit, n = self._limit(), self.measurement.array.n_sensors
        wanted = self.n_sources if isinstance(self.n_sources, int) else 1
        if wanted > limit:
            raise ValueError(
                f"n_sources must be at most {limit}: a subspace method finds fewer sources than "
                f"it has sensors, and {type(self).__name__} no more than {limit} on this array of "
                f"{n}; got {wanted}"
            )

    def _limit(self) -> int:
        return self._finder(self._seen_by(self.measurement)).limit

    @property
    def n_slots(self) -> int:
        """Number of sources that may be reported at once."""
        if isinstance(self.n_sources, int):
            return self.n_sources
        most = self.measurement.array.n_sensors - 1
        return min(self.max_sources or most, most)

    def predict(self, u: ArrayLike | None = None, *, dt: float = 1.0) -> None:
        """Let the past fade; what is believed of the directions stays."""
        not_negative("dt", dt)
        fading = self.forgetting**dt
        self.total, self.squares = fading * self.total, fading**2 * self.squares

    def update(self, z: ArrayLike | None) -> None:
        """Learn from one snapshot, (n_sensors,); each `interval`-th time, look for directions."""
        if is_missing(z):
            return
        z = self.measurement.snapshot(np.asarray(z))
        self._learn(z)
        self.total, self.squares = self.total + 1, self.squares + 1
        self.n_heard = self.n_heard + 1
        if self.n_heard % self.interval == 0:
            self.report(**vars(self._described(self._directions(), z)))

    @abstractmethod
    def _learn(self, z: Complex) -> None:
        """Take in one snapshot, NaN where a sensor was not heard."""

    @abstractmethod
    def _weights(self) -> Float:
        """Return how much each sensor was heard, (n_sensors,)."""

    @abstractmethod
    def _decomposed(self, live: Bool) -> tuple[Float, Complex]:
        """Return the eigenvalues of the covariance of some sensors, falling, and their vectors."""

    @abstractmethod
    def _finder(self, model: ArraySnapshot) -> F:
        """Return what finds directions with the sensors of the model."""

    def _seen_by(self, model: ArraySnapshot) -> ArraySnapshot:
        """Return the model of the sensors that the eigenvectors belong to."""
        return model

    def _looked(self) -> tuple[F, Subspaces] | None:
        """Return the subspaces of the sensors heard, and what finds directions from them."""
        if self.squares == 0:  # nothing was heard, or all has faded
            return None
        weights = self._weights()
        live = weights > FADED * weights.max()
        model = self.measurement
        if not live.all():
            model = model.replace(array=model.array.without(np.flatnonzero(~live)))
        try:
            finder = self._finder(self._seen_by(model))
        except ValueError:  # too few sensors are left for the method
            return None
        values, vectors = self._decomposed(live)
        K = min(self._number(values), finder.limit) if values[:1].any() else 0
        return (finder, Subspaces(vectors[:, :K], vectors[:, K:])) if K > 0 else None

    def _directions(self) -> Float:
        """Return the directions, rad, in rising order."""
        looked = self._looked()
        return np.zeros(0) if looked is None else np.sort(looked[0].directions(looked[1]))

    def _number(self, values: Float) -> int:
        """Return the number of sources, given or found."""
        if isinstance(self.n_sources, int):
            return self.n_sources
        n_snapshots = self.total**2 / self.squares  # equal weights would tell as much
        found = number_of_sources(values, n_snapshots, self.n_sources or "mdl")
        return min(int(found), self.n_slots)

    def _described(self, doa: Float, z: Complex) -> DirectionEstimate:
        unknown = np.full(len(doa), np.nan)
        a = self.measurement.steering_vector(doa)
        label = np.full(len(doa), -1)
        return DirectionEstimate(doa, unknown, unknown, fitted(a, z), label)


class CovarianceSubspace(RunningCovariance, SubspaceTracker[F]):
    """Subspaces by the eigenvectors of a running covariance, smoothed for coherent sources."""

    def __init__(
        self,
        measurement: ArraySnapshot,
        n_sources: NumberOfSources = "mdl",
        *,
        max_sources: int | None = None,
        forgetting: float = 0.96,
        smoothing: int | None = None,
        backward: bool = False,
        interval: int = 1,
    ) -> None:
        self.smoothing, self.backward = smoothing, instance("backward", backward, bool)
        self._set_up(
            measurement=measurement,
            n_sources=n_sources,
            max_sources=max_sources,
            forgetting=forgetting,
            interval=interval,
        )
        self._know_nothing(measurement.array.n_sensors)

    def predict(self, u: ArrayLike | None = None, *, dt: float = 1.0) -> None:
        """Let the past fade; what is believed of the directions stays."""
        super().predict(u, dt=dt)
        self._fade(dt)

    def _learn(self, z: Complex) -> None:
        self._add(z)

    def _weights(self) -> Float:
        return self.weight.diagonal()

    def _is_smoothed(self) -> bool:
        return self.smoothing is not None or self.backward

    def _subarray(self, n_sensors: int) -> int:
        return n_sensors if self.smoothing is None else self.smoothing

    def _decomposed(self, live: Bool) -> tuple[Float, Complex]:
        R = self._mean()
        if not live.all():
            R = R[np.ix_(live, live)]
        if self._is_smoothed():
            order = np.argsort(self.measurement.array.positions[live, 0])
            R = smoothed(R[np.ix_(order, order)], self._subarray(len(R)), backward=self.backward)
        values, vectors = np.linalg.eigh(R)
        return values[::-1], vectors[:, ::-1]

    def _seen_by(self, model: ArraySnapshot) -> ArraySnapshot:
        """Return the model of the first subarray, or of all sensors without smoothing."""
        if not self._is_smoothed():
            return model
        places, n = np.sort(model.array.positions[:, 0]), model.array.n_sensors
        length = count("smoothing", self._subarray(n))
        spacing = model.array.spacing
        uniform = spacing is not None and round((places[-1] - places[0]) / spacing) == n - 1
        if not uniform or length > n:
            raise ValueError(
                f"spatial smoothing needs a uniform line without gaps of at least {length} "
                f"sensors; this array has {n} sensors in {model.array.dim} dimension(s)"
                + ("" if uniform else ", not a uniform line")
            )
        return model.replace(array=SensorArray(places[:length]))
