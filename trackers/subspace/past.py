"""PAST: the signal subspace by recursive least squares, without a covariance or its eigenvectors.

Equation numbers are those of Yang, "Projection approximation subspace tracking", IEEE Trans.
Signal Process. 43(1), 1995.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from arrivals.measurement_models.array_snapshot import ArraySnapshot
from arrivals.trackers.registry import register
from arrivals.trackers.subspace.base import Finder, NumberOfSources, SubspaceTracker, on_grid
from arrivals.trackers.subspace.esprit import Shift
from arrivals.trackers.subspace.music import Scan
from arrivals.trackers.subspace.root_music import Roots
from arrivals.typing import Bool, Complex, Float
from arrivals.validation import count, one_of

LONGEST = 1e-6  # what has faded to a millionth is gone: bounds P after a silence
WIDEST = 1e12  # of P, relative to the power: a direction that nothing excites winds up no further


def past_step(W: Complex, P: Complex, y: Complex, beta: ArrayLike) -> tuple[Complex, Complex]:
    """Return W and P after one snapshot: the algorithm PAST as printed.

    Parameters
    ----------
    W : ndarray, shape (..., n_sensors, n_sources)
        Basis of the signal subspace, nearly orthonormal.
    P : ndarray, shape (..., n_sources, n_sources)
        Inverse of the weighted sum of z zᴴ, z = Wᴴy.
    y : ndarray, shape (..., n_sensors)
        Snapshot.
    beta : float or array_like, shape (...)
        Weight that the past keeps.

    References
    ----------
    Yang, table I.

    Examples
    --------
    >>> W, P = np.array([[1.0], [0.0]]), np.eye(1)
    >>> for _ in range(20):
    ...     W, P = past_step(W, P, np.array([3.0, 4.0]), 0.9)
    >>> W.round(3).ravel()
    array([0.6, 0.8])
    """
    beta = np.asarray(beta)[..., None, None]
    y = y[..., None]
    z = W.conj().swapaxes(-1, -2) @ y
    h = P @ z
    hH = h.conj().swapaxes(-1, -2)
    gH = hH / (beta + (hH @ z).real)
    P = (P - h * gH) / (2 * beta)
    P = P + P.conj().swapaxes(-1, -2)  # the Hermitian part: rounding would grow as β⁻ⁿ
    return W + (y - W @ z) * gH, P


@register("past")
class PAST(SubspaceTracker[Finder]):
    """Directions from a signal subspace that is tracked snapshot by snapshot.

    Parameters
    ----------
    measurement : ArraySnapshot
        What `method` asks for: a line on a uniform grid, or any array for "music".
    n_sources, max_sources, forgetting, interval
        As in `MUSIC`. Where a criterion finds the number, a subspace of `max_sources` dimensions
        is tracked, and the power outside it is taken to be noise. That wants room: `max_sources`
        is below half the sensors if None; with more, false sources are found at first.
    method : {"esprit", "root_music", "music"}
        How directions are found from the subspace.
    n_directions : int
        Look directions of the method "music".

    Attributes
    ----------
    W : ndarray, shape (n_sensors, n_tracked)
        Basis of the subspace, nearly orthonormal.
    inverse : ndarray, shape (n_tracked, n_tracked)
        P of the paper: the inverse of the weighted sum of z zᴴ, z = Wᴴy.
    energy : float
        Weighted sum of ‖y‖².
    heard : ndarray, shape (n_sensors,)
        Sum of the weights of the snapshots in which each sensor was heard.
    age : float
        Time since the last snapshot that held anything.

    Raises
    ------
    ValueError
        If the array does not suit the method, or `n_sources` is beyond what it can find.

    Notes
    -----
    Labels are -1, `std` and `existence` NaN. Directions stand in rising order. A sensor that is
    missing is filled in by the subspace: by W z, z fitted to the others. P starts at the inverse
    power of the first snapshot, so that the unit of the samples does not matter.

    References
    ----------
    Yang, table I; the number of sources as in his part on PASTd, sec. V.

    Examples
    --------
    >>> from arrivals.measurement_models import SensorArray
    >>> model = ArraySnapshot(SensorArray.ula(8, spacing=0.5), wavelength=1.0, noise=0.1)
    >>> phases = np.exp(2j * np.pi * np.random.default_rng(0).random((100, 2)))
    >>> z = model.simulate(np.full((100, 2), [-0.2, 0.5]), phases, np.random.default_rng(1))
    >>> PAST(model, n_sources=2).run(z).doa[-1].round(2)
    array([-0.2,  0.5])
    """

    def __init__(
        self,
        measurement: ArraySnapshot,
        n_sources: NumberOfSources = "mdl",
        *,
        max_sources: int | None = None,
        forgetting: float = 0.96,
        interval: int = 1,
        method: str = "esprit",
        n_directions: int = 361,
    ) -> None:
        self.method = one_of("method", method, ("esprit", "root_music", "music"))
        self.n_directions = count("n_directions", n_directions, least=3)
        self._set_up(
            measurement=measurement,
            n_sources=n_sources,
            max_sources=max_sources,
            forgetting=forgetting,
            interval=interval,
        )
        self.age, self.heard = 0.0, np.zeros(measurement.array.n_sensors)
        self._start()

    def _start(self) -> None:
        self.W = np.eye(self.measurement.array.n_sensors, self.n_slots, dtype=np.complex128)
        self.inverse, self.energy = np.eye(self.n_slots, dtype=np.complex128), 0.0

    @property
    def n_slots(self) -> int:
        """Number of sources that may be reported at once: the dimensions tracked."""
        if isinstance(self.n_sources, int):
            return self.n_sources
        n = self.measurement.array.n_sensors
        return min(self.max_sources or max(1, (n - 1) // 2), n - 1)

    def predict(self, u: ArrayLike | None = None, *, dt: float = 1.0) -> None:
        """Let the past fade; what is believed of the directions stays."""
        super().predict(u, dt=dt)
        self.heard = self.forgetting**dt * self.heard
        self.age = self.age + dt

    def _learn(self, z: Complex) -> None:
        if self.W.shape[1] != self.n_slots:  # the number of sources was changed
            self._start()
        heard = ~np.isnan(z)
        self.heard = self.heard + heard
        y = z if heard.all() else filled(self.W, z)
        power = float(np.vdot(y, y).real)
        if power == 0:
            return
        if self.energy == 0:
            self.inverse = np.eye(len(self.inverse), dtype=np.complex128) * (len(y) / power)
        beta = max(self.forgetting**self.age, LONGEST)
        self.W, P = past_step(self.W, self.inverse, y, beta)
        self.energy, self.age = beta * self.energy + power, 0.0
        width = self.energy * float(P.trace().real)
        self.inverse = P if width < WIDEST else P * (WIDEST / width)

    def _weights(self) -> Float:
        return self.heard

    def _decomposed(self, live: Bool) -> tuple[Float, Complex]:
        """Return eigenvectors and eigenvalues of W P⁻¹Wᴴ, the rest of the power spread evenly."""
        n, L = int(live.sum()), min(int(live.sum()), self.W.shape[1])
        if self.energy == 0:
            return np.zeros(n), np.eye(n, dtype=np.complex128)
        Q, R = np.linalg.qr(self.W[live], mode="complete")
        S = R[:L] @ np.linalg.solve(self.inverse, R[:L].conj().T)
        values, turn = np.linalg.eigh((S + S.conj().T) / 2)
        noise = (self.energy - values.sum()) / max(n - L, 1)
        values = np.concatenate([values[::-1], np.full(n - L, max(noise, 0.0))])
        return values, np.concatenate([Q[:, :L] @ turn[:, ::-1], Q[:, L:]], axis=1)

    def _finder(self, model: ArraySnapshot) -> Finder:
        if self.method == "music":
            return Scan(model.array, model.plain_wavelength("past"), self.n_directions)
        return Roots(on_grid(model)) if self.method == "root_music" else Shift(on_grid(model))


def filled(W: Complex, y: Complex) -> Complex:
    """Return a snapshot whose missing sensors, NaN, hear what the others make likely: W z.

    Examples
    --------
    >>> filled(np.array([[0.6], [0.8]]), np.array([3.0, np.nan])).round(6)
    array([3., 4.])
    """
    heard = ~np.isnan(y)
    z = np.linalg.lstsq(W[heard], y[heard], rcond=None)[0]
    return np.where(heard, y, W @ z)
