"""Coherence of noise between the sensors of an array, and the matrices that whiten it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike

from arrivals.measurement_models.arrays.element_response import complex_from_texts, complex_to_texts
from arrivals.measurement_models.arrays.sensor_array import SensorArray
from arrivals.measurements import numbers
from arrivals.messages import shown
from arrivals.parameters import FrozenModel
from arrivals.typing import Bool, Complex, Float, Int
from arrivals.validation import number

MIN_EIGENVALUE = 1e-9  # of a matrix with ones on the diagonal
MIN_WHITE = 1e-8  # the smallest eigenvalue of diffuse noise is that of its white part, rounded
MAX_ROUNDING = 1e-9  # of the diagonal, and of Γ - Γᴴ


@dataclass(frozen=True, eq=False)
class NoiseCoherence(FrozenModel):
    """Coherence Γ of the noise between sensors: its covariance is the variance of one times Γ.

    Parameters
    ----------
    matrix : array_like of complex, shape (n_bins, n_sensors, n_sensors) or (n_sensors, n_sensors)
        Hermitian and positive definite with ones on the diagonal; one for each bin, or for all.

    Raises
    ------
    ValueError
        If it is not such a matrix.

    Examples
    --------
    >>> noise = NoiseCoherence([[1.0, 0.6], [0.6, 1.0]])
    >>> noise.whitening(np.array([True, True])).real
    array([[[ 1.  ,  0.  ],
            [-0.75,  1.25]]])
    """

    matrix: Complex

    def __post_init__(self) -> None:
        matrix = np.array(_checked("noise_coherence", self.matrix), dtype=np.complex128)
        matrix.setflags(write=False)
        object.__setattr__(self, "matrix", matrix)

    @property
    def per_bin(self) -> Complex:
        """Γ with the axis of the bins: (n_bins or 1, n_sensors, n_sensors)."""
        return self.matrix if self.matrix.ndim == 3 else self.matrix[None]

    def without(self, sensors: Sequence[int] | Int) -> NoiseCoherence:
        """Return the coherence of the others, without some sensors, named by index."""
        kept = np.setdiff1d(np.arange(self.matrix.shape[-1]), sensors)
        return NoiseCoherence(self.matrix[..., kept[:, None], kept])

    def only(self, bins: Sequence[int] | Int) -> NoiseCoherence:
        """Return the coherence at some of the bins."""
        return self if self.matrix.ndim == 2 else NoiseCoherence(self.matrix[list(bins)])

    def whitening(self, sensors: Bool) -> Complex:
        """Return L, L Γ Lᴴ = I, of the sensors in a mask (n_sensors,): (n_bins or 1, n, n)."""
        return _whitening(self, sensors.tobytes())

    def to_dict(self) -> dict[str, Any]:
        """Return the configuration, complex numbers as text."""
        return {"type": self.type_name(), "matrix": complex_to_texts(self.matrix)}

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, NoiseCoherence):
            return NotImplemented
        return bool(np.array_equal(self.matrix, other.matrix))

    def __hash__(self) -> int:
        return self._hash

    @cached_property
    def _hash(self) -> int:
        return hash((self.matrix.shape, self.matrix.tobytes()))


@lru_cache(maxsize=256)
def _whitening(noise: NoiseCoherence, sensors: bytes) -> Complex:
    valid = np.frombuffer(sensors, dtype=np.bool_)
    # L = chol(Γ)⁻¹, of the rows and columns of the sensors
    C = np.linalg.cholesky(noise.per_bin[:, valid][:, :, valid])
    L = np.asarray(np.linalg.inv(C), dtype=np.complex128)
    L.setflags(write=False)
    return L


def gap_whitening(noise: NoiseCoherence, valid: Bool) -> Complex:
    """Return whitening matrices of snapshots with gaps, zero for the missing sensors.

    Parameters
    ----------
    noise : NoiseCoherence
    valid : ndarray of bool, shape (n_bins, n_snapshots, n_sensors)
        Sensors with data.

    Returns
    -------
    ndarray of complex, shape (n_bins, n_snapshots or 1, n_sensors, n_sensors)
        One for all snapshots where those with data have the same gaps.

    Examples
    --------
    >>> noise = NoiseCoherence([[1.0, 0.6], [0.6, 1.0]])
    >>> gap_whitening(noise, np.array([[[True, False]]])).real
    array([[[[1., 0.],
             [0., 0.]]]])
    """
    n_bins, n_snapshots, M = valid.shape
    if (valid == valid[0, 0]).all():  # the usual case
        return _embedded(noise, valid[0, 0], n_bins)
    patterns, index = np.unique(valid.reshape(-1, M), axis=0, return_inverse=True)
    used = np.flatnonzero(patterns.any(axis=1))
    if len(used) == 1:
        return _embedded(noise, patterns[used[0]], n_bins)
    W = np.zeros((n_bins, n_snapshots, M, M), dtype=np.complex128)
    for i in used:
        here = index.reshape(n_bins, n_snapshots, 1, 1) == i
        W = np.where(here, _embedded(noise, patterns[i], n_bins), W)
    return W


def _embedded(noise: NoiseCoherence, sensors: Bool, n_bins: int) -> Complex:
    """Return L of some sensors in matrices of all of them: (n_bins, 1, M, M)."""
    W = np.zeros((n_bins, 1, len(sensors), len(sensors)), dtype=np.complex128)
    W[:, 0, np.outer(sensors, sensors)] = noise.whitening(sensors).reshape(-1, sensors.sum() ** 2)
    return W


def diffuse_coherence(array: SensorArray, wavelengths: ArrayLike, white: float = 0.1) -> Complex:
    """Return the coherence of diffuse noise, waves from all directions of the sphere.

        Γ = (1 - white) sinc(2 d/λ) + white I

    Parameters
    ----------
    array : SensorArray
        Isotropic sensors; d is the distance of two of them.
    wavelengths : array_like, shape (n_bins,)
        Metres.
    white : float
        Share of the variance that is white, from 1e-8 to 1.

    Returns
    -------
    ndarray, shape (n_bins, n_sensors, n_sensors)

    References
    ----------
    Cook, Waterhouse, Berendt, Edelman and Thompson, "Measurement of correlation coefficients in
    reverberant sound fields", JASA 27(6), 1955.

    Examples
    --------
    >>> diffuse_coherence(SensorArray.ula(2, 0.25), [1.0, 0.5], white=0.2).real.round(3)[:, 0]
    array([[1.   , 0.509],
           [1.   , 0.   ]])
    """
    p = array.positions
    distance = np.linalg.norm(p[:, None] - p, axis=-1)
    spread = np.sinc(2 * distance / np.asarray(wavelengths)[:, None, None])
    return np.asarray((1 - white) * spread + white * np.eye(len(p)) + 0j)


def coherence_of(
    name: str, value: Any, n_bins: int, array: SensorArray
) -> Literal["white", "diffuse"] | NoiseCoherence:
    """Return "white", "diffuse" or the matrices of an array.

    Examples
    --------
    >>> coherence_of("noise_coherence", np.eye(3), 1, SensorArray.ula(2, 0.5))
    Traceback (most recent call last):
    ValueError: noise_coherence must have shape (2, 2) or (1, 2, 2); got (3, 3)
    """
    if isinstance(value, str):
        if value not in ("white", "diffuse"):
            raise ValueError(f"{name} must be 'white', 'diffuse' or an array; got {shown(value)}")
        return "white" if value == "white" else "diffuse"
    noise = value if isinstance(value, NoiseCoherence) else NoiseCoherence(value)
    one = array.n_sensors, array.n_sensors
    if noise.matrix.shape not in (one, (n_bins, *one)):
        raise ValueError(
            f"{name} must have shape {one} or {(n_bins, *one)}; got {noise.matrix.shape}"
        )
    return noise


def white_share(white: Any) -> float:
    """Return a share of white noise from 1e-8 to 1.

    Examples
    --------
    >>> white_share(0)
    Traceback (most recent call last):
    ValueError: white must lie in [1e-08, 1]; got 0
    """
    if not MIN_WHITE <= number("white", white) <= 1:
        raise ValueError(f"white must lie in [{MIN_WHITE}, 1]; got {shown(white)}")
    return float(white)


def _checked(name: str, value: Any) -> Complex | Float:
    """Return a Hermitian, positive definite matrix with unit diagonal, or a stack of them."""
    is_text = _has_text(value)
    matrix = numbers(name, complex_from_texts(name, np.asarray(value)) if is_text else value)
    if matrix.ndim not in (2, 3) or matrix.shape[-1] != matrix.shape[-2] or not matrix.size:
        wanted = "(n_sensors, n_sensors) or (n_bins, n_sensors, n_sensors)"
        raise ValueError(f"{name} must have shape {wanted}; got {matrix.shape}")
    if not np.isfinite(matrix).all():
        raise ValueError(f"{name} must be finite; got NaN, or an infinite number")
    diagonal = np.diagonal(matrix, axis1=-2, axis2=-1)
    off = np.abs(diagonal - 1)
    if off.max() > MAX_ROUNDING:
        worst = shown(diagonal.ravel()[off.argmax()].item())
        raise ValueError(f"{name} must have ones on the diagonal; got {worst}")
    skew = np.abs(matrix - np.swapaxes(matrix, -1, -2).conj()).max()
    if skew > MAX_ROUNDING:
        raise ValueError(f"{name} must be Hermitian; got entries {skew:.3g} off")
    smallest = np.linalg.eigvalsh(matrix).min()
    if smallest < MIN_EIGENVALUE:
        cure = "add a share of the identity"
        raise ValueError(
            f"{name} must be positive definite; got an eigenvalue of {smallest:.3g}: {cure}"
        )
    return matrix


def _has_text(value: Any) -> bool:
    return isinstance(value, str) or (isinstance(value, list) and any(map(_has_text, value)))
