"""Methods that are compared: this library's, pyroomacoustics', and SRP-PHAT with Kalman filters."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from arrivals.measurement_models import ArraySnapshot
from arrivals.motion_models import ConstantVelocity
from arrivals.motion_models.von_mises import wrap
from arrivals.scenarios.room_acoustics.speech_signals import RATE
from arrivals.scenarios.simulations.rooms import (
    HOP,
    SPEED,
    WINDOW,
    WINDOWS,
    RoomRecording,
    TalkersInRoom,
)
from arrivals.trackers import (
    DirectionTracker,
    NewtonSolver,
    PeaksGNN,
    find_peaks,
    refine_peaks,
)
from arrivals.trackers.beamforming import scan_directions
from arrivals.typing import Complex, Float, Int


class Found(NamedTuple):
    """Directions, degrees, (n_steps, n_slots), NaN where there is none.

    Labels, and standard deviations, degrees; None if the method has none.
    """

    doa_deg: Float
    label: Int | None
    std_deg: Float | None = None


Method = Callable[[TalkersInRoom, RoomRecording, Int], Found]


def nothing(scene: TalkersInRoom, recording: RoomRecording, n_active: Int) -> Found:
    """Report no direction."""
    return Found(np.full((len(n_active), 1), np.nan), np.full((len(n_active), 1), -1))


def tracker(
    name: str, n_bins: int | None = 16, coherence: str = "white", **settings: Any
) -> Method:
    """Return a tracker of this library on bins of the band; all of them if None."""

    def run(scene: TalkersInRoom, recording: RoomRecording, n_active: Int) -> Found:
        if n_bins is not None:
            scene = scene.replace(n_bins=n_bins)
        trial = scene.trial(recording)
        model = scene.measurement.replace(noise_coherence=coherence)
        one = trial.tracker(name, **{"measurement": model} | settings)
        result = one.run(trial.measurements)
        label = result.label
        std = np.rad2deg(result.std) if np.isfinite(result.std).any() else None
        return Found(np.rad2deg(result.doa), label if (label >= 0).any() else None, std)

    return run


class PhaseTransform(DirectionTracker):
    """Peaks of the steered response power with phase transform, SRP-PHAT: at most two.

    The second is a peak of the map from which the response to a wave from the first is subtracted.

    Parameters
    ----------
    measurement : ArraySnapshot
        Array, bins and snapshots.
    threshold : float
        Least height of a peak: mean cosine over pairs of sensors, bins and snapshots.
    second : float
        Least height of the second peak, relative to the first.
    width : float
        Least distance of the second peak from the first, rad.
    """

    def __init__(
        self,
        measurement: ArraySnapshot,
        threshold: float = 0.08,
        second: float = 0.65,
        width: float = np.deg2rad(20.0),
    ) -> None:
        self.measurement, self.threshold, self.second, self.width = (
            measurement, threshold, second, width,
        )  # fmt: skip
        self.doa_grid = scan_directions(measurement.array, 181)
        i, j = self.pairs = np.triu_indices(measurement.array.n_sensors, 1)
        A = measurement.steering_vector(self.doa_grid)  # (n_grid, n_bins, n_sensors)
        self.W = (A[..., i] * A[..., j].conj()).reshape(len(self.doa_grid), -1)
        self.overlap = (self.W.conj() @ self.W.T).real / self.W.shape[1]
        self.reset()

    @property
    def n_slots(self) -> int:
        """Maximum number of peaks."""
        return 2

    def predict(self, u: ArrayLike | None = None, *, dt: float = 1.0) -> None:
        """Report no direction: each step is processed on its own."""
        self.reset()

    def update(self, z: ArrayLike | None) -> None:
        """Report the peaks of one step, (n_bins, n_snapshots, n_sensors)."""
        y = np.asarray(z)
        y = y / np.maximum(np.abs(y), 1e-12)
        i, j = self.pairs
        C = np.mean(y[..., i] * y[..., j].conj(), axis=1).ravel()
        P = (self.W.conj() @ C).real / len(C)
        circular = self.measurement.array.dim > 1
        first = int(P.argmax())
        if P[first] < self.threshold:
            self.report([])
            return
        doa = [float(refine_peaks(self.doa_grid, P, np.array([first]))[0])]
        rest = P - P[first] * self.overlap[first]
        peaks = find_peaks(rest, circular=circular)
        for peak in peaks[rest[peaks] >= self.second * P[first]][:1]:
            if np.abs(wrap(self.doa_grid[peak] - doa[0])) > self.width:
                doa.append(float(self.doa_grid[peak]))
        self.report(doa)


def srp_phat_kalman(scene: TalkersInRoom, recording: RoomRecording, n_active: Int) -> Found:
    """Run nearest-neighbour Kalman filters on the peaks of SRP-PHAT."""
    trial = scene.trial(recording)
    one = PeaksGNN(
        scene.measurement, detector=PhaseTransform(scene.measurement),
        motion=ConstantVelocity(q=np.deg2rad(0.14) ** 2, n_dims=1), std=np.deg2rad(5.0),
        gate=2.0, confirm_steps=3, patience=3, max_sources=8,
    )  # fmt: skip
    result = one.run(trial.measurements)
    return Found(np.rad2deg(result.doa), result.label)


def pyroomacoustics(name: str) -> Method:
    """Return a method of pyroomacoustics, 1° a grid step, given the number of active talkers."""

    def run(scene: TalkersInRoom, recording: RoomRecording, n_active: Int) -> Found:
        import pyroomacoustics as pra

        array, band = scene.measurement.array, scene.frequencies
        line = array.dim == 1
        azimuth = np.deg2rad(np.arange(181) if line else np.arange(-180, 180))
        places = np.pad(array.positions.T, ((0, 1), (0, 0))) if line else array.positions.T
        spectra = all_bins(recording.samples)  # (n_steps, n_sensors, n_bins, n_windows)
        doa = np.full((len(n_active), max(int(n_active.max()), 1)), np.nan)
        methods: dict[int, Any] = {}
        for step, n in enumerate(n_active.tolist()):
            if not n:
                continue
            if n not in methods:
                kind = pra.doa.algorithms[name]
                methods[n] = kind(places, RATE, WINDOW, c=SPEED, num_src=n, azimuth=azimuth)
            # up to the alias limit: 1.5 times it is the end of the scene's band
            edges = [max(500.0, band[0]), band[-1] / 1.5]
            methods[n].locate_sources(spectra[step], freq_range=edges)
            found = np.rad2deg(np.atleast_1d(methods[n].azimuth_recon))
            doa[step, : len(found)] = 90 - found if line else found
        return Found(doa, None)

    return run


def all_bins(samples: Float) -> Complex:
    """Return the spectra of the windows, (n_steps, n_sensors, n_bins, n_windows)."""
    n_steps = ((len(samples) - WINDOW) // HOP + 1) // WINDOWS
    rows = HOP * np.arange(n_steps * WINDOWS)[:, None] + np.arange(WINDOW)
    y = np.fft.rfft(samples[rows] * np.hanning(WINDOW + 1)[:-1, None], axis=1)
    y = y.reshape(n_steps, WINDOWS, -1, samples.shape[1])
    return np.ascontiguousarray(np.transpose(y, (0, 3, 2, 1)))


def svalse(n_bins: int = 16, coherence: str = "white", **settings: Any) -> Method:
    """Return `svalse` with settings of its Newton solver."""
    return tracker("svalse", n_bins, coherence, solver=NewtonSolver(**settings))


METHODS: dict[str, Method] = {
    "nothing": nothing,
    "svalse": tracker("svalse"),
    "svalse, recorded": svalse(tempering=16.0, max_snr_db=10.0, power_floor=10.0),
    "svalse, 64 bins, white": svalse(64, tempering=32.0, power_floor=1.0),
    "svalse, 64 bins, diffuse": svalse(64, "diffuse", tempering=32.0, power_floor=1.0),
    "cbf": tracker("cbf", None),
    "music": tracker("music", None),
    "SRP, number given": pyroomacoustics("SRP"),
    "NormMUSIC, number given": pyroomacoustics("NormMUSIC"),
    "SRP-PHAT + Kalman": srp_phat_kalman,
    "wideband_mixture": tracker("wideband_mixture", None),
}
