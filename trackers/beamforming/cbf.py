"""The conventional beamformer: peaks of the Bartlett spectrum of each step."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from arrivals.measurement_models.array_snapshot import ArraySnapshot
from arrivals.trackers.beamforming.block_scan import (
    can_scan,
    plane_wave_responses,
    scan_responses,
    scan_rows,
)
from arrivals.trackers.beamforming.model_grid import number_of_directions, scan_grid
from arrivals.trackers.beamforming.scan_ends import scan_is_joined
from arrivals.trackers.beamforming.scan_grid import ScanGrid, log_level
from arrivals.trackers.beamforming.spectrum import bartlett_power, mean_beam_power
from arrivals.trackers.direction_tracker import DirectionTracker, warn_of_ambiguity
from arrivals.trackers.kinds_of_estimates import kind_of_estimate
from arrivals.trackers.registry import register
from arrivals.typing import Bool, Complex, Float
from arrivals.validation import count, instance, no_control, positive, time_step


@register("cbf")
class CBF(DirectionTracker):
    """Peaks of the conventional beamformer, within some dB of the highest.

    Parameters
    ----------
    measurement : ArraySnapshot
        Any array, of one angle or of azimuth and elevation; of its noise, only the coherence is
        used. With several bins or snapshots per step the powers are averaged, each direction at the
        slowness or elevation of largest power.
    n_directions : int, optional
        Scan directions: over ±90° for a line, over the circle, or on the sphere. If None, 361,
        every half degree of a line; on the sphere one in 2 by 2 degrees: 10313, on a half 5157.
    threshold_db : float
        Peaks more than this below the highest are not reported, dB.
    max_sources : int, optional
        Maximum number of peaks; the number of sensors if None.

    Attributes
    ----------
    grid : ScanGrid
        Scan directions.
    doa_grid, power : ndarray, shape (n_directions,)
        Scan directions, on the sphere their azimuths, rad, and the beam power of the last step; NaN
        before the first.

    Notes
    -----
    Where the noise is coherent, the power is that of the whitened snapshots, |ãᴴz̃|² / ‖ã‖², which
    noise alone leaves equal in all directions; ã = L a, z̃ = L z.

    Each step is processed on its own: labels are -1, `std` and `existence` NaN. A peak is refined
    by a parabola through three points of the spectrum in dB; on the sphere by the highest of finer
    and finer stencils about it, to less than 0.2 degrees.

    References
    ----------
    Park, Meyer and Gerstoft, JASA 153(1), 2023, section VI (the comparator CBF).

    Examples
    --------
    >>> from arrivals.measurement_models import SensorArray
    >>> model = ArraySnapshot(SensorArray.ula(15, spacing=0.5), wavelength=1.0)
    >>> tracker = CBF(model, threshold_db=3.0)
    >>> tracker.update(model.array.steering_vector(0.5, 1.0))
    >>> tracker.estimate.doa.round(3), abs(tracker.estimate.amplitude).round(3)
    (array([0.5]), array([1.]))
    """

    def __init__(
        self,
        measurement: ArraySnapshot,
        *,
        n_directions: int | None = None,
        threshold_db: float = 10.0,
        max_sources: int | None = None,
    ) -> None:
        self.measurement = instance("measurement", measurement, ArraySnapshot)
        self.n_directions = number_of_directions(n_directions)
        self.threshold_db = positive("threshold_db", threshold_db)
        self.max_sources = max_sources
        if max_sources is not None:
            count("max_sources", max_sources, maximum=1000)
        warn_of_ambiguity(measurement)
        self.reset()

    def reset(self) -> None:
        """Return to the state after construction: no spectrum, no direction."""
        self._discard_spectrum()

    def _discard_spectrum(self) -> None:
        name = type(self).__name__
        self.estimate_kind = kind_of_estimate(self.measurement, name, "azimuth", "sphere")
        self.power = np.full(len(self.doa_grid), np.nan)
        self.report_none()

    @property
    def grid(self) -> ScanGrid:
        """Scan directions."""
        return scan_grid(self.measurement, self.n_directions)

    @property
    def doa_grid(self) -> Float:
        """Scan directions, on the sphere their azimuths, rad, (n_directions,)."""
        return self.grid.doa

    @property
    def n_slots(self) -> int:
        """Maximum number of reported peaks."""
        return self.max_sources or self.measurement.array.n_sensors

    def predict(self, u: ArrayLike | None = None, *, dt: float = 1.0) -> None:
        """Discard the spectrum: steps are independent."""
        time_step(dt)
        no_control(u)
        self._discard_spectrum()

    def update(self, z: ArrayLike | None) -> None:
        """Report the peaks of one measurement; missing sensors are left out."""
        z = self.measurement.snapshot(z)
        if np.isnan(z).all():
            return
        self.add_data(z)
        if not can_scan(self.measurement, self.scanned_sensors(z)):
            return
        self.power = self._power_at(None, z)
        joined = self._has_joined_ends(z)
        directions, power = self.grid.peaks(
            self.power, log_level, lambda each: self._power_at(each, z), self.n_slots, joined
        )
        highest = max(self.power.max(), power.max(initial=0.0))
        directions = directions[:, power > highest * 10 ** (-self.threshold_db / 10)]
        self.report_directions(directions, amplitude=self._amplitude(directions, z))

    def add_data(self, z: Complex) -> None:
        """Do nothing: steps are independent."""

    def scanned_sensors(self, z: Complex) -> Bool:
        """Return the sensors of the spectrum after a snapshot or several, (n_sensors,)."""
        return np.asarray(~np.isnan(z).all(axis=tuple(range(z.ndim - 1))))

    def _has_joined_ends(self, z: Complex) -> bool:
        """Return True if the two ends of a line's scan are one direction."""
        array, sensors = self.measurement.array, self.scanned_sensors(z)
        if array.dim == 1 and not sensors.all():
            array = array.without(np.flatnonzero(~sensors))
        return scan_is_joined(array, self.measurement.wavelengths)

    def _power_at(self, directions: Float | None, z: Complex) -> Float:
        """Return the spectrum of a step at directions (n_unknowns, n); on the grid if None."""
        model = self.measurement
        if not model.is_plain:
            return self.block_spectrum(model.with_all_axes(z), directions)
        if directions is None:
            return self.spectrum(scan_rows(model, self.grid), z)
        return self.spectrum(model.steering_vector(*directions), z)

    def _amplitude(self, directions: Float, z: Complex) -> Complex:
        """Return amplitudes, or the root of the mean power over several bins and snapshots."""
        model = self.measurement
        if model.is_plain:
            return self.amplitudes(model.steering_vector(*directions), z)
        return self.block_amplitudes(directions, model.with_all_axes(z))

    def block_spectrum(self, Y: Complex, directions: Float | None = None) -> Float:
        """Return the mean power of several bins and snapshots.

        Parameters
        ----------
        Y : ndarray, shape (n_bins, n_sensors, n_snapshots)
            Snapshots; NaN where a sensor has no valid data.
        directions : ndarray, shape (n_unknowns, n), optional
            Directions, rad; those of the scan if None.

        Returns
        -------
        ndarray, shape (n,)
            The largest over slowness or elevation.
        """
        model = self.measurement
        if directions is None:
            A = scan_responses(model, self.grid, whitened=False).A
        else:
            A = plane_wave_responses(model, directions)
        Y, A = model.whitened(Y, A)
        return mean_beam_power(A, Y, isotropic=model.unknowns == "sphere")

    def block_amplitudes(self, directions: Float, Y: Complex) -> Complex:
        """Return the root of the mean power of plane waves over bins and snapshots.

        Parameters
        ----------
        directions : ndarray, shape (n_unknowns, n_sources)
            Directions, rad.
        Y : ndarray, shape (n_bins, n_sensors, n_snapshots)
            Snapshots; NaN where a sensor has no valid data.

        Returns
        -------
        ndarray, shape (n_sources,)
            Amplitudes, real.
        """
        model = self.measurement
        Y, A = model.whitened(Y, plane_wave_responses(model, directions))
        valid = ~np.isnan(Y)
        n_valid, bins = valid.any(axis=1).sum(axis=1), valid.any(axis=(1, 2))
        share = valid[bins].sum(axis=2) / n_valid[bins, None]  # of the snapshots with data
        power = (A.real**2 + A.imag**2)[:, bins] * share[..., None]
        norm = power.sum(axis=2).mean(axis=1)  # (n_nuisance, n)
        if model.is_single:
            return np.asarray(A[0, 0].conj().T @ np.where(valid, Y, 0)[0, :, 0] / norm[0])
        beam = np.array([mean_beam_power(a[None], Y) for a in A])
        best = beam.argmax(axis=0), np.arange(beam.shape[1])
        return np.asarray(np.sqrt(beam[best] / norm[best]) + 0j)

    def spectrum(self, A: Complex, z: Complex) -> Float:
        """Return the power of one snapshot from directions with steering vectors A.

        Parameters
        ----------
        A : ndarray, shape (n_directions, n_sensors)
            Rows a(β).
        z : ndarray, shape (n_sensors,)
            Snapshot; NaN where a sensor has no valid data.

        Returns
        -------
        ndarray, shape (n_directions,)
            |aᴴz|² / ‖a‖².
        """
        return bartlett_power(A, z)

    def amplitudes(self, A: Complex, z: Complex) -> Complex:
        """Return the amplitudes of plane waves with steering vectors A, each without the others.

        Parameters
        ----------
        A : ndarray, shape (n_sources, n_sensors)
            Rows a(β).
        z : ndarray, shape (n_sensors,)
            Snapshot; NaN where a sensor has no valid data.

        Returns
        -------
        ndarray, shape (n_sources,)
            aᴴz / ‖a‖².
        """
        valid = ~np.isnan(z)
        return np.asarray(A[:, valid].conj() @ z[valid] / valid.sum())
