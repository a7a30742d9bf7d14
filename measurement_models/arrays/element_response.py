"""Complex gains of array elements over the azimuth."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from arrivals.parameters import FrozenModel
from arrivals.typing import Complex


@dataclass(frozen=True, eq=False)
class ElementResponse(FrozenModel):
    """Complex gains of directional, coupled or measured elements, as functions of the azimuth.

    Parameters
    ----------
    gains : array_like, shape (n_angles, n_sensors) or (n_bins, n_angles, n_sensors)
        At the azimuths 2π i / n_angles, i = 0, 1, ..., of each element in the array's order; one
        table for all frequencies, or one for each. They multiply the steering vector.

    Raises
    ------
    ValueError
        If the shape is wrong, or a gain is not finite.

    Notes
    -----
    Between the azimuths of the table the gain is the trigonometric polynomial through them.

    Examples
    --------
    >>> cardioids = ElementResponse.first_order(facing=[0.0, np.pi])
    >>> abs(cardioids([0.0, np.pi / 2]))[0].round(3)
    array([[1. , 0. ],
           [0.5, 0.5]])
    """

    gains: Complex

    def __post_init__(self) -> None:
        try:
            gains = np.array(self.gains)
        except ValueError:
            raise ValueError("gains must have rows of one length; got a ragged list") from None
        if gains.dtype.kind not in "biufc":
            gains = complex_from_texts("gains", gains)
        gains = gains.astype(np.complex128)
        if gains.ndim not in (2, 3) or 0 in gains.shape:
            raise ValueError(
                "gains must have shape (n_angles, n_sensors) or (n_bins, n_angles, n_sensors); "
                f"got {gains.shape}"
            )
        if not np.isfinite(gains).all():
            raise ValueError(
                "gains must be finite; got NaN or inf: remove the sensors without data"
            )
        gains.setflags(write=False)
        object.__setattr__(self, "gains", gains)

    @classmethod
    def first_order(cls, facing: ArrayLike, omni: ArrayLike = 0.5) -> ElementResponse:
        """Make elements of gain omni + (1 - omni) cos(azimuth - facing).

        Parameters
        ----------
        facing : array_like, shape (n_sensors,)
            Azimuths of their axes, rad.
        omni : array_like, shape () or (n_sensors,)
            1 for an isotropic element, 1/2 for a cardioid, 0 for a figure of eight.
        """
        facing = np.asarray(facing, dtype=np.float64)
        azimuth = 2 * np.pi * np.arange(4)[:, None] / 4
        return cls(np.asarray(omni) + (1 - np.asarray(omni)) * np.cos(azimuth - facing) + 0j)

    @property
    def n_sensors(self) -> int:
        """Number of elements."""
        return int(self.gains.shape[-1])

    @property
    def n_bins(self) -> int | None:
        """Number of frequencies in the table; None if one holds for all."""
        return int(self.gains.shape[0]) if self.gains.ndim == 3 else None

    def __call__(self, azimuth: ArrayLike, *, slope: bool = False) -> Complex:
        """Return gains at azimuths (...), rad, or their slopes: (n_bins or 1, ..., n_sensors)."""
        table = self.gains if self.gains.ndim == 3 else self.gains[None]
        n = table.shape[1]
        series = np.fft.fft(table, axis=1) / n
        k = np.fft.fftfreq(n, 1 / n)
        if n % 2 == 0:  # the highest harmonic is a cosine: half of it of either sign
            series[:, n // 2] /= 2
            series = np.concatenate([series, series[:, n // 2, None]], axis=1)
            k = np.append(k, n / 2)
        d = np.exp(1j * np.multiply.outer(np.asarray(azimuth, dtype=np.float64), k))
        return np.asarray(np.einsum("...k,fkm->f...m", d * 1j * k if slope else d, series))

    def without(self, sensors: ArrayLike) -> ElementResponse:
        """Return the elements without some, named by index."""
        return ElementResponse(np.delete(self.gains, np.asarray(sensors, dtype=int), axis=-1))

    def to_dict(self) -> dict[str, object]:
        """Return the configuration, complex numbers as text."""
        return {"type": self.type_name(), "gains": complex_to_texts(self.gains)}

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, ElementResponse):
            return NotImplemented
        return bool(np.array_equal(self.gains, other.gains))

    def __hash__(self) -> int:
        return hash((self.gains.shape, self.gains.tobytes()))


def complex_to_texts(values: Complex) -> list[object]:
    """Return complex numbers as text, which JSON can hold.

    Examples
    --------
    >>> complex_to_texts(np.array([[1 + 2j, 3j]]))
    [['(1+2j)', '3j']]
    """
    if values.ndim == 1:
        return [str(x) for x in values.tolist()]
    return [complex_to_texts(x) for x in values]


def complex_from_texts(name: str, values: NDArray[Any]) -> Complex:
    """Return the complex numbers that `complex_to_texts` made text.

    Examples
    --------
    >>> complex_from_texts("gains", np.array(["(1+2j)", "3j"]))
    array([1.+2.j, 0.+3.j])
    """
    try:
        return np.asarray(np.vectorize(complex, otypes=[np.complex128])(values))
    except (TypeError, ValueError, OverflowError):
        raise TypeError(f"{name} must be numbers; got {values.dtype}") from None
