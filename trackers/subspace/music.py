"""MUSIC: peaks of the inverse projection of steering vectors onto the noise subspace."""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from arrivals.measurement_models.array_snapshot import ArraySnapshot
from arrivals.trackers.beamforming.model_grid import number_of_directions, scan_grid
from arrivals.trackers.beamforming.scan_grid import ScanGrid
from arrivals.trackers.registry import register
from arrivals.trackers.subspace.base import NumberOfSources
from arrivals.trackers.subspace.covariance import CovarianceSubspace
from arrivals.trackers.subspace.music_spectrum import (
    NormalizedSearch,
    SpectrumSearch,
    spectrum_search,
)
from arrivals.typing import Float


@register("music")
class MUSIC(CovarianceSubspace[SpectrumSearch | NormalizedSearch]):
    """Peaks of MUSIC's spectrum, for any array.

    Parameters
    ----------
    measurement : ArraySnapshot
        Any array: a line, or sensors in a plane, where directions are azimuths on the full
        circle, or azimuth and elevation. Of its noise, only the coherence is used. With several
        bins the spectrum is the mean of theirs, each relative to its maximum (NormMUSIC), each
        direction at the slowness or elevation of the largest mean.
    n_sources : int, "mdl" or "aic"
        Number of sources, below the number of sensors; or the criterion that estimates it at each
        step, summed over the bins. None is "mdl".
    max_sources : int, optional
        Maximum number that a criterion may find; the maximum of the method if None.
    forgetting : float
        Weight of the past after one unit of time; the covariance averages about
        1 / (1 - forgetting) snapshots.
    smoothing : int, optional
        Sensors of the subarrays that the covariance is averaged over, which resolves coherent
        echoes of one source; for uniform lines without gaps. None: no smoothing.
    backward : bool
        Average with the covariance of the reversed line; for uniform lines without gaps.
    interval : int
        Directions are computed at every `interval`-th snapshot and do not change in between.
    n_directions : int, optional
        Scan directions: over ±90° for a line, over the circle, or on the sphere. If None, 361,
        every half degree of a line; on the sphere one in 2 by 2 degrees: 10313, on a half 5157.

    Attributes
    ----------
    covariance : ndarray, shape ([n_bins,] n_sensors, n_sensors)
        Weighted sum of the snapshots' outer products, of each bin if there are several.
    grid : ScanGrid
        Scan directions.
    doa_grid, power : ndarray, shape (n_directions,)
        Scan directions, on the sphere their azimuths, rad, and the spectrum; NaN while there is no
        source.

    Raises
    ------
    ValueError
        If `n_sources` is not below the number of sensors (of a subarray, with smoothing), or
        smoothing is requested for an array that is not a uniform line.

    Notes
    -----
    Labels are -1, `std` and `existence` NaN. Directions are in ascending order, of azimuth on the
    sphere; `amplitude` is the least-squares fit to the last snapshot, or the root of its mean power
    over the bins and snapshots of the step. Sensors without valid data for a long time are left
    out, and bins; with smoothing, no source is detected without all sensors.

    References
    ----------
    Schmidt, "Multiple emitter location and signal parameter estimation", IEEE Trans. Antennas
    Propag. 34(3), 1986. Several bins: Salvati, Drioli and Foresti, "Incoherent frequency fusion
    for broadband steered response power algorithms in noisy environments", IEEE Signal Process.
    Lett. 21(5), 2014.

    Examples
    --------
    >>> from arrivals.measurement_models import SensorArray
    >>> model = ArraySnapshot(SensorArray.uca(8, radius=0.6), wavelength=1.0, noise=0.1)
    >>> phases = np.exp(2j * np.pi * np.random.default_rng(0).random((50, 2)))
    >>> z = model.simulate(np.full((50, 2), [-2.0, 0.5]), phases, np.random.default_rng(1))
    >>> MUSIC(model).run(z).doa[-1, :2].round(2)
    array([-2. ,  0.5])
    """

    unknowns: ClassVar[tuple[str, ...]] = ("azimuth", "sphere")

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
        n_directions: int | None = None,
    ) -> None:
        self.n_directions = number_of_directions(n_directions)
        super().__init__(
            measurement,
            n_sources,
            max_sources=max_sources,
            forgetting=forgetting,
            smoothing=smoothing,
            backward=backward,
            interval=interval,
        )

    def direction_finder(self, model: ArraySnapshot) -> SpectrumSearch | NormalizedSearch:
        """Return the peak search on the scan grid."""
        return spectrum_search(model, self.grid)

    @property
    def grid(self) -> ScanGrid:
        """Scan directions."""
        return scan_grid(self.measurement, self.n_directions)

    @property
    def doa_grid(self) -> Float:
        """Scan directions, on the sphere their azimuths, rad, (n_directions,)."""
        return self.grid.doa

    @property
    def power(self) -> Float:
        """Present spectrum, (n_directions,); NaN while there is no source."""
        current = self.current_subspaces()
        if current is None:
            return np.full(len(self.doa_grid), np.nan)
        finder, subspaces = current
        return finder.spectrum(subspaces)[1]
