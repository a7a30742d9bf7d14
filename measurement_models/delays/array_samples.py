"""Real samples of one source on a line array; directions as delays between sensors."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike

from arrivals.measurement_models.arrays.sensor_array import SensorArray
from arrivals.measurement_models.delays.band_filter import BandFilter
from arrivals.measurement_models.delays.source_correlation import SourceCorrelation
from arrivals.measurements import real_numbers
from arrivals.parameters import FrozenModel
from arrivals.typing import Float, Int
from arrivals.validation import instance, items, number, positive

MARGIN = 1.1  # of the edges of a filter, so that it does not change the spectrum in the band

MOST_DB = 300  # of a signal-to-noise ratio


@dataclass(frozen=True)
class ArraySamples(FrozenModel):
    """Samples of one source by a line array: y_j(k) = s(k - jΔ) + v_j(k).

    This is the door between angles and delays. The method's papers count the sensors j in the
    order in which a wave from a positive angle passes them. Here a sensor at a larger coordinate
    is nearer to a source at a positive `doa` and receives it earlier, so that j counts from the
    largest coordinate downwards, and Δ = κ sin β, κ = rate · spacing / speed.

    Parameters
    ----------
    array : SensorArray
        A line on a uniform grid, gaps allowed, with a wave speed.
    rate : float
        Samples per second, Hz.
    correlation : SourceCorrelation
        Of the source, its frequencies in cycles per sample.
    snr_db : float
        Power of the source over that of the noise, at one sensor.
    power : float, optional
        Power of the source at one sensor; if None, a tracker estimates it from the data.
    band : (float, float), optional
        Band that a tracker filters the samples to, Hz, as hum, offsets and other sources outside of
        the source's band need; if None, samples are used as they are.

    Attributes
    ----------
    kappa : float
        κ, the delay between neighbouring grid points at endfire, samples.
    grid_index : ndarray of int, shape (n_sensors,)
        Grid point of each sensor, counted from the largest coordinate.
    n_grid_points : int
        Number of grid points from the first sensor to the last.
    band_filter : BandFilter or None
        Filter to `band`; None if there is nothing to filter.
    received_noise_ratio : float
        ε after that filter: of white noise, the share within the band.

    Raises
    ------
    ValueError
        If the array is not such a line, or its grid is wider than half the shortest wavelength, so
        that directions would be ambiguous.

    Notes
    -----
    Shapes: one real sample of every sensor, (..., n_sensors), is a snapshot. Delays in samples,
    directions from broadside in rad.

    Examples
    --------
    >>> from arrivals.measurement_models import Tones
    >>> array = SensorArray.ula(10, spacing=0.5, speed=1000.0)
    >>> model = ArraySamples(array, rate=4000.0, correlation=Tones(0.25), snr_db=5.0)
    >>> model.kappa, model.delay([np.pi / 6]).round(6), model.doa([1.0]).round(6)
    (2.0, array([1.]), array([0.523599]))
    """

    array: SensorArray
    rate: float
    correlation: SourceCorrelation
    snr_db: float = 0.0
    power: float | None = None
    band: Sequence[float] | None = None
    kappa: float = field(init=False, repr=False, compare=False)
    grid_index: Int = field(init=False, repr=False, compare=False)
    n_grid_points: int = field(init=False, repr=False, compare=False)
    band_filter: BandFilter | None = field(init=False, repr=False, compare=False)
    received_noise_ratio: float = field(init=False, repr=False, compare=False)

    @property
    def places(self) -> Int:
        """The same as `grid_index`."""
        return self.grid_index

    def __post_init__(self) -> None:
        instance("array", self.array, SensorArray)
        instance("correlation", self.correlation, SourceCorrelation)  # type: ignore[type-abstract]  # any
        positive("rate", self.rate)
        if not abs(number("snr_db", self.snr_db)) <= MOST_DB:
            raise ValueError(f"snr_db must be from -{MOST_DB} to {MOST_DB}; got {self.snr_db}")
        if self.power is not None:
            positive("power", self.power)
        band = None if self.band is None else checked_band(self.band, self.rate)
        filtered = None if band is None else band_filter(band, self.rate)
        share = 1.0 if filtered is None else filtered.noise_share
        object.__setattr__(self, "band", band)
        object.__setattr__(self, "band_filter", filtered)
        object.__setattr__(self, "received_noise_ratio", share * self.noise_ratio)
        spacing = self.array.spacing
        if spacing is None:
            raise ValueError(
                "array must be a line of two or more sensors on a uniform grid (gaps are allowed); "
                f"got {self.array.n_sensors} sensors in {self.array.dim} dimension(s)"
            )
        if self.array.speed is None:
            raise ValueError("array must have a wave speed, m/s; got None")
        p = self.array.positions[:, 0]
        grid_index = np.rint((p.max() - p) / spacing).astype(np.int64)
        grid_index.setflags(write=False)
        object.__setattr__(self, "kappa", self.rate * spacing / self.array.speed)
        object.__setattr__(self, "grid_index", grid_index)
        object.__setattr__(self, "n_grid_points", int(grid_index.max()) + 1)
        if 2 * self.correlation.highest * self.kappa > 1 + 1e-6:
            limit = self.rate / (2 * self.kappa)
            raise ValueError(
                "frequencies of the source must not exceed the array's alias limit, "
                f"{limit:.6g} Hz; got {self.correlation.highest * self.rate:.6g} Hz"
            )

    @property
    def noise_ratio(self) -> float:
        """ε, noise power over source power."""
        return 10 ** (-float(self.snr_db) / 10)

    def frame(self, z: ArrayLike) -> Float:
        """Return snapshots on the grid: (..., n_sensors) -> (..., n_grid_points), else NaN.

        Raises
        ------
        TypeError
            If the numbers are not real.
        ValueError
            If there is not one number a sensor.
        """
        z = real_numbers("z", z)
        if z.ndim == 0 or z.shape[-1] != self.array.n_sensors:
            raise ValueError(
                f"a snapshot must have shape (..., {self.array.n_sensors}), one sample a sensor; "
                f"got {z.shape}"
            )
        return self.on_grid(z)

    def on_grid(self, z: Float) -> Float:
        """Return `frame` without the checks."""
        frame = np.full((*z.shape[:-1], self.n_grid_points), np.nan)
        frame[..., self.grid_index] = z
        return frame

    def delay(self, doa: ArrayLike) -> Float:
        """Return the delay between neighbours, samples, of directions, rad."""
        return np.asarray(self.kappa * np.sin(doa))

    def doa(self, delay: ArrayLike) -> Float:
        """Return the directions, rad, of delays, samples; those beyond ±κ are at endfire."""
        return np.asarray(np.arcsin(np.clip(np.asarray(delay) / self.kappa, -1, 1)))

    def delay_std(self, doa: ArrayLike, std: ArrayLike) -> Float:
        """Return standard deviations of delays, samples, of directions known to `std`, rad."""
        return np.asarray(self.kappa * np.cos(doa) * np.asarray(std))

    def doa_std(self, delay: ArrayLike, std: ArrayLike) -> Float:
        """Return standard deviations of directions, rad; cos β is taken as 0.05 at least."""
        return np.asarray(
            np.asarray(std) / (self.kappa * np.maximum(np.cos(self.doa(delay)), 0.05))
        )


@lru_cache(maxsize=32)
def band_filter(band: tuple[float, float], rate: float) -> BandFilter | None:
    """Return the filter to a band, Hz, with edges a tenth outside; the same one every time.

    Examples
    --------
    >>> band_filter((0.0, 4000.0), 8000.0) is None
    True
    """
    low, high = band[0] / MARGIN / rate, min(band[1] * MARGIN / rate, 0.5)
    return None if (low, high) == (0.0, 0.5) else BandFilter(low, high)


def checked_band(band: Sequence[float], rate: float) -> tuple[float, float]:
    """Return the edges of a band, Hz.

    Examples
    --------
    >>> checked_band([500.0, 300.0], 8000.0)
    Traceback (most recent call last):
    ValueError: band must lie between 0 and half the rate, 4000 Hz; got 500 and 300
    """
    edges = items("band", band)
    if len(edges) != 2:
        raise ValueError(f"band must be two frequencies, Hz; got {len(edges)}")
    low, high = (number("band", edge) for edge in edges)
    if not 0 <= low < high <= rate / 2:
        raise ValueError(
            f"band must lie between 0 and half the rate, {rate / 2:g} Hz; got {low:g} and {high:g}"
        )
    return low, high
