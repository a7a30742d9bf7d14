"""Noise of complex snapshots: its coherence between sensors, whitening, and likelihood."""

from __future__ import annotations

from abc import abstractmethod
from dataclasses import replace
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from arrivals.measurement_models.arrays.noise_coherence import (
    NoiseCoherence,
    diffuse_coherence,
    gap_whitening,
)
from arrivals.measurement_models.arrays.plane_waves import PlaneWaves
from arrivals.measurement_models.manifolds.manifold import Reference
from arrivals.measurement_models.observed import MISSING, ObservedSnapshots
from arrivals.measurement_models.single_source import SingleSourceSnapshot
from arrivals.measurement_models.snapshot_likelihood import (
    from_composite,
    log_known,
    log_marginal,
)
from arrivals.measurement_models.snapshots.gate import SnapshotGate
from arrivals.measurement_models.snapshots.waves import SnapshotWaves
from arrivals.typing import Bool, Complex, Float
from arrivals.validation import real


class SnapshotNoise(SnapshotWaves, SnapshotGate, SingleSourceSnapshot):
    """Mixin of models of complex snapshots: noise of covariance `noise` Γ, white or coherent.

    Attributes
    ----------
    noise : float
        Variance of the noise of one sensor.
    noise_coherence : {"white", "diffuse"} or NoiseCoherence
        Γ.
    white : float
        White share of diffuse noise.
    power : float
        Prior variance of a source's complex amplitude.
    """

    noise_coherence: object
    white: float
    power: float

    @property
    @abstractmethod
    def waves(self) -> PlaneWaves:
        """Response of the array to plane waves."""

    @cached_property
    def coherence(self) -> NoiseCoherence | None:
        """Coherence Γ of the noise between sensors; None if it is white."""
        if isinstance(self.noise_coherence, NoiseCoherence):
            return self.noise_coherence
        if self.noise_coherence == "white":
            return None
        waves = self.waves
        return NoiseCoherence(diffuse_coherence(waves.array, waves.wavelengths, self.white))

    def whitening(self, sensors: Bool | None = None) -> Complex:
        """Return the matrices L that make the noise of some sensors white, L Γ Lᴴ = I.

        Parameters
        ----------
        sensors : ndarray of bool, shape (n_sensors,), optional
            Those with valid data; all if None.

        Returns
        -------
        ndarray of complex, shape (n_bins, n, n)
            For snapshots L z, responses L a and covariances L R Lᴴ of these n sensors. Read-only.

        Examples
        --------
        >>> from arrivals.measurement_models import ArraySnapshot, SensorArray
        >>> model = ArraySnapshot(SensorArray.ula(3, 0.2), 1.0, noise_coherence="diffuse")
        >>> L = model.whitening(np.array([True, False, True]))
        >>> L.shape, bool(np.allclose(L.conj().swapaxes(1, 2) @ L, np.linalg.inv(
        ...     model.coherence.per_bin[:, ::2, ::2])))
        ((1, 2, 2), True)
        """
        M = self.shape[-1]
        sensors = np.ones(M, dtype=np.bool_) if sensors is None else sensors
        n = int(sensors.sum())
        L = np.eye(n) + 0j if self.coherence is None else self.coherence.whitening(sensors)
        return np.broadcast_to(L, (self.n_bins, n, n))

    def whitened(self, Y: Complex, A: Complex) -> tuple[Complex, Complex]:
        """Return snapshots and responses after whitening, those without gaps and others.

        Parameters
        ----------
        Y : ndarray of complex, shape (n_bins, n_sensors, n_snapshots)
            As from `snapshots`; NaN where a sensor gave no number.
        A : ndarray of complex, shape (n_nuisance, n_bins, n_sensors, n)
            Responses to plane waves, as from `waves.steering`.

        Returns
        -------
        Y : ndarray of complex, shape (n_bins, n_sensors, n_snapshots)
            NaN where it was. Snapshots of unequal gaps are bins of their own, (n_bins n_snapshots,
            n_sensors, 1), as each gap has another whitening.
        A : ndarray of complex, shape (n_nuisance, n_bins, n_sensors, n)
            Of the same bins, zero for missing sensors. Both are as they were if noise is white.

        Examples
        --------
        >>> from arrivals.measurement_models import ArraySnapshot, SensorArray
        >>> model = ArraySnapshot(SensorArray.uca(5, 0.2), 1.0, noise_coherence="diffuse")
        >>> a = model.waves.steering([0.3])
        >>> Y, A = model.whitened(2 * a[0], a)
        >>> bool(np.allclose(Y, 2 * A[0]))
        True
        """
        W = self.gap_whitening(Y)
        if W is None:
            return Y, A
        if W.shape[1] > 1:
            W = W.reshape(-1, 1, *W.shape[2:])
            A = np.repeat(A, Y.shape[2], axis=1)
            Y = np.swapaxes(Y, 1, 2).reshape(len(W), -1, 1)
        W, missing = W[:, 0], np.isnan(Y)
        return np.where(missing, MISSING, W @ np.where(missing, 0, Y)), W @ A

    def gap_whitening(self, Y: Complex) -> Complex | None:
        """Return the whitening matrices of snapshots with gaps; None if the noise is white.

        Parameters
        ----------
        Y : ndarray of complex, shape (n_bins, n_sensors, n_snapshots)
            NaN where a sensor gave no number.

        Returns
        -------
        ndarray of complex, shape (n_bins, n_snapshots or 1, n_sensors, n_sensors), or None
            Zero in the rows and columns of missing sensors; one for all snapshots if those with
            data have the same sensors.
        """
        if self.coherence is None:
            return None
        return gap_whitening(self.coherence, np.swapaxes(~np.isnan(Y), 1, 2))

    def observe(
        self, z: ArrayLike | None, reference: Reference = "middle"
    ) -> ObservedSnapshots | None:
        """Return the valid data as `SnapshotGate.observe` does, in white noise: L z."""
        observed = super().observe(z, reference)
        if observed is None or self.coherence is None:
            return observed
        L = self.whitening(observed.sensors)[observed.bins]
        return replace(observed, snapshots=L @ observed.snapshots)

    def log_likelihood(
        self,
        z: ArrayLike,
        doa: ArrayLike,
        amplitude: ArrayLike | None = None,
        elevation: ArrayLike | None = None,
        distance: ArrayLike | None = None,
    ) -> Float:
        """Return ln p(z | β) for directions (..., n_sources), rad.

        z ~ CN(0, power Σ a aᴴ + noise Γ) in every snapshot, the amplitudes integrated out; sensors
        that are NaN are left out of theirs. An unknown slowness or elevation is averaged over,
        each value as likely.

        Parameters
        ----------
        z : array_like, shape `shape` or (dim_z,)
            One measurement, complex, or real as `composite` makes it.
        doa : array_like, shape (..., n_sources)
            Directions, rad.
        amplitude : array_like, shape (..., n_sources), optional
            Complex amplitudes where they are known: then z ~ CN(Σ w a, noise Γ).
        elevation, distance : array_like, shape (..., n_sources), optional
            Elevations, rad, and distances from the centroid, m, of the sources: waves are
            horizontal, and plane, if None.

        Returns
        -------
        ndarray, shape (...)
        """
        z = from_composite(z, self.shape)
        doa = real("doa", doa)
        Y = self.snapshots(z)
        W = self.gap_whitening(Y)
        if amplitude is not None:
            expected = self.wave(doa, amplitude, elevation, distance)
            return log_known(self.snapshot(z), expected, self.noise, W)
        if elevation is None and distance is None:
            a = self.waves.steering(doa.ravel())
            a = a.reshape(*a.shape[:3], *doa.shape)
        else:
            a = self.steering_vector(doa, elevation, distance)
            a = a.reshape(*doa.shape, self.n_bins, self.shape[-1])
            a = np.moveaxis(a, (-2, -1), (0, 1))[None]
        return log_marginal(Y, a, self.noise, self.power, W)

    @property
    def R(self) -> Float:
        """Covariance of the composite noise: half the variance for each part."""
        if self.coherence is None:
            return super().R
        M, n = self.shape[-1], self.dim_z // 2 // self.shape[-1]  # bins and snapshots
        G = np.zeros((n, M, n, M), dtype=np.complex128)
        blocks = np.broadcast_to(self.coherence.per_bin, (self.n_bins, M, M))
        G[np.arange(n), :, np.arange(n)] = np.repeat(blocks, self.n_snapshots, axis=0)
        S = G.reshape(n * M, n * M)
        return np.asarray(self.noise / 2 * np.block([[S.real, -S.imag], [S.imag, S.real]]))

    def draw_noise(self, shape: tuple[int, ...], rng: np.random.Generator) -> Complex:
        """Draw noise of measurements (..., *self.shape), complex."""
        u = rng.standard_normal((*shape, 2)) @ np.array([1, 1j]) * np.sqrt(self.noise / 2)
        if self.coherence is None:
            return np.asarray(u)
        M = self.shape[-1]
        C = np.linalg.cholesky(self.coherence.per_bin)
        rows = u.reshape(-1, self.n_bins, self.n_snapshots, M) @ np.swapaxes(C, 1, 2)
        return np.asarray(rows).reshape(shape)
