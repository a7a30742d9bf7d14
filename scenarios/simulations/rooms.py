"""Talkers in a reverberant room and a small microphone array."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import Literal

import numpy as np

from arrivals.measurement_models import ArraySnapshot, SensorArray
from arrivals.motion_models import BernoulliVonMises
from arrivals.motion_models.von_mises import wrap
from arrivals.recordings.choice import BandLimits
from arrivals.recordings.framing import frame_recording, frequencies_in
from arrivals.recordings.recording import Recording
from arrivals.scenarios.base import Scenario, Trial
from arrivals.scenarios.registry import register
from arrivals.scenarios.room_acoustics.diffuse_noise import diffuse_noise
from arrivals.scenarios.room_acoustics.image_sources import Shoebox, convolve_moving
from arrivals.scenarios.room_acoustics.layouts import (
    SIZE,
    RoomLayout,
    draw_azimuths,
    draw_layout,
)
from arrivals.scenarios.room_acoustics.speech_signals import (
    RATE,
    Utterance,
    activity,
    speech_like,
    utterances,
)
from arrivals.scenarios.simulations.speech import SHIPPED, shipped_speech
from arrivals.typing import Bool, Complex, Float, Int
from arrivals.validation import count, number, one_of, positive

SPEED = 343.0  # m/s
WINDOW, HOP, WINDOWS = 512, 256, 8  # samples; windows of a step of 128 ms
STEP = HOP * WINDOWS  # samples
MIN_ACTIVE = 1 / 3  # least share of a step in which a talker is active
ARRAYS = {
    "circle": SensorArray.uca(6, 0.046, speed=SPEED),
    "line": SensorArray.ula(8, 0.04, speed=SPEED),
    "square": SensorArray(0.016 * np.array([[1, 1], [-1, 1], [-1, -1], [1, -1]]), speed=SPEED),
}


@dataclass(frozen=True, eq=False)
class RoomRecording:
    """Samples of the microphones with directions and activity of the talkers, at 16 kHz.

    Parameters
    ----------
    samples : ndarray, shape (n_samples, n_sensors)
        Received signals.
    doa : ndarray, shape (n_samples, n_talkers)
        Directions, rad, of active and inactive talkers.
    active : ndarray of bool, shape (n_samples, n_talkers)
        Activity, at the array.
    """

    samples: Float
    doa: Float
    active: Bool


@register("room")
@dataclass(frozen=True)
class TalkersInRoom(Scenario):
    """Talkers, standing or moving, in a reverberant room; pauses between utterances.

    A room of 6 x 5 x 2.8 m with the array near its middle, 1.2 m high, talkers 1 to 1.8 m away.
    A step has 8 windows of 512 samples, half overlapping, at 16 kHz: 128 ms.

    Parameters
    ----------
    array : {"circle", "line", "square"}
        Six microphones on a circle of radius 4.6 cm, eight on a line, 4 cm apart, or four on a
        square of 3.2 cm.
    n_talkers, n_moving : int
        Number of talkers, at most 3, and how many of them move, by 60° during the recording.
    rt60, order : float and int
        Reverberation time, s, and reflections, as in `Shoebox`.
    snr_db : float
        Mean power of the active talkers over that of the white noise of a microphone, dB.
    diffuse_snr_db : float, optional
        The same power over that of diffuse pink noise, dB; without it if None.
    duration : float
        Length of the recording, s.
    n_bins : int, optional
        Number of frequencies, evenly spaced; if None, all bins from 300 Hz to 1.5 times the
        frequency at which the smallest spacing is half of one wavelength.
    voices : {"synthetic", "shipped"}
        `speech_like` signals up to 8 kHz, or the two shipped recordings, which end at 4 kHz.

    Notes
    -----
    The truth has a direction in the steps of which a talker is active in at least a third, NaN in
    the others. On a line it is the angle from broadside of the cone on which the talker is.
    Talkers are at least 30° apart, 20° if one moves.

    References
    ----------
    Allen and Berkley, JASA 65(4), 1979 (image sources).

    Examples
    --------
    >>> trial = TalkersInRoom(duration=2.0).sample(np.random.default_rng(0))
    >>> trial.measurements.shape, np.rad2deg(trial.truth[[0, 8], 0]).round(1)
    ((15, 169, 8, 6), array([ nan, 49.3]))
    """

    array: Literal["circle", "line", "square"] = "circle"
    n_talkers: int = 1
    n_moving: int = 0
    rt60: float = 0.25
    order: int = 10
    snr_db: float = 20.0
    diffuse_snr_db: float | None = None
    duration: float = 8.0
    n_bins: int | None = None
    voices: Literal["synthetic", "shipped"] = "synthetic"

    def __post_init__(self) -> None:
        one_of("array", self.array, tuple(ARRAYS))
        count("n_talkers", self.n_talkers, maximum=3)
        count("n_moving", self.n_moving, minimum=0, maximum=self.n_talkers)
        self.room  # noqa: B018  (rejects invalid rt60 and order)
        number("snr_db", self.snr_db)
        if self.diffuse_snr_db is not None:
            number("diffuse_snr_db", self.diffuse_snr_db)
        if positive("duration", self.duration) < 1:
            raise ValueError(f"duration must be at least 1 s; got {self.duration:g}")
        if self.n_bins is not None:
            count("n_bins", self.n_bins, maximum=len(self.replace(n_bins=None).frequencies))
        one_of("voices", self.voices, ("synthetic", "shipped"))

    @property
    def room(self) -> Shoebox:
        """Room with its walls."""
        return Shoebox(SIZE, self.rt60, self.order, SPEED)

    @property
    def frequencies(self) -> list[float]:
        """Frequencies, Hz."""
        limits = BandLimits.of(ARRAYS[self.array], RATE)
        bins = frequencies_in((limits.low, limits.high), RATE, WINDOW)
        chosen = np.linspace(0, len(bins) - 1, self.n_bins or len(bins))
        return [bins[i] for i in np.round(chosen).astype(np.int64)]

    @property
    def measurement(self) -> ArraySnapshot:
        """The array with its bins and windows."""
        array = ARRAYS[self.array]
        wavelengths = [array.wavelength(f) for f in self.frequencies]
        return ArraySnapshot(array, wavelengths, n_snapshots=WINDOWS)

    def layout(self, rng: np.random.Generator) -> RoomLayout:
        """Draw the places of the array and the talkers.

        Parameters
        ----------
        rng : numpy.random.Generator
            Source of random numbers.

        Returns
        -------
        RoomLayout
            Places and directions.
        """
        azimuth = draw_azimuths(self.n_talkers, self.n_moving, rng, line=self.array == "line")
        return draw_layout(ARRAYS[self.array].positions, azimuth, rng)

    def voice(self, talker: int, rng: np.random.Generator) -> Utterance:
        """Draw a talker's voice: a function of a number of samples and random numbers.

        Parameters
        ----------
        talker : int
            Number of the talker, from 0.
        rng : numpy.random.Generator
            Source of random numbers.

        Returns
        -------
        callable
            Function that draws an utterance at 16 kHz, as `utterances` takes it.
        """
        if self.voices == "shipped":
            return partial(shipped_speech, SHIPPED[talker % len(SHIPPED)])
        return partial(speech_like, pitch=rng.uniform(90, 220), tract=rng.uniform(0.9, 1.2))

    def responses(self, layout: RoomLayout, talker: int) -> list[Float]:
        """Return the impulse responses from the places of a talker.

        Parameters
        ----------
        layout : RoomLayout
            Places of all talkers.
        talker : int
            Number of the talker, from 0.

        Returns
        -------
        list of ndarray, each of shape (n_taps, n_sensors)
            Responses at 16 kHz.
        """
        return [self.room.response(at, layout.sensors, RATE) for at in layout.places[talker]]

    def record(self, rng: np.random.Generator) -> RoomRecording:
        """Draw one recording.

        Parameters
        ----------
        rng : numpy.random.Generator
            Source of random numbers.

        Returns
        -------
        RoomRecording
            Samples and truth.
        """
        layout, n = self.layout(rng), int(RATE * self.duration)
        samples = np.zeros((n, len(layout.sensors)))
        doa, active, powers = [], [], []
        for talker, places in enumerate(layout.places):
            start = rng.uniform(0.2, 0.5) + 1.2 * talker
            signal = utterances(n, start, self.voice(talker, rng), rng)
            signal *= 10 ** (rng.uniform(-1.5, 1.5) / 20)
            received = convolve_moving(signal, self.responses(layout, talker))
            lag = int(RATE / SPEED * np.linalg.norm(places[0] - layout.sensors.mean(axis=0)))
            on = np.concatenate([np.zeros(lag, dtype=np.bool_), activity(signal)[: n - lag]])
            samples += received
            powers.append(np.mean(received[on] ** 2) if on.any() else np.nan)
            active.append(on)
            at = np.linspace(0, n - 1, len(places))
            doa.append(np.interp(np.arange(n), at, layout.doa[talker]))
        power = np.nanmean(powers)
        noise = rng.standard_normal(samples.shape)
        samples += np.sqrt(power * 10 ** (-self.snr_db / 10)) * noise
        if self.diffuse_snr_db is not None:
            diffuse = diffuse_noise(n, layout.sensors, RATE, rng, speed=SPEED)
            samples += np.sqrt(power * 10 ** (-self.diffuse_snr_db / 10)) * diffuse
        return RoomRecording(samples, np.stack(doa, axis=1), np.stack(active, axis=1))

    def sample(self, rng: np.random.Generator) -> Trial:
        """Draw one trial; the motion model has 3° a step."""
        return self.trial(self.record(rng))

    def trial(self, recording: RoomRecording) -> Trial:
        """Return the trial of a recording: its snapshots, the truth of the steps and the models.

        Parameters
        ----------
        recording : RoomRecording
            Samples and truth, of the same array.

        Returns
        -------
        Trial
            As `sample` draws it.
        """
        z = self.frames(recording.samples)
        centre, rows = step_samples(len(recording.samples))
        active = recording.active[rows].mean(axis=1) >= MIN_ACTIVE
        truth = np.where(active, wrap(recording.doa[centre]), np.nan)
        motion = BernoulliVonMises(sigma_doa=np.deg2rad(3.0), p_activate=0.05, p_deactivate=0.02)
        return Trial(z, truth, self.measurement, motion)

    def frames(self, samples: Float) -> Complex:
        """Return the snapshots of samples (n_samples, n_sensors): (n_steps, *measurement.shape)."""
        return frame_recording(
            Recording(samples, RATE), self.frequencies, window=WINDOW, hop=HOP, n_snapshots=WINDOWS
        ).values


def step_samples(n_samples: int) -> tuple[Int, Int]:
    """Return the middles of the steps, (n_steps,), and the samples about them, (n_steps, 2048).

    The last sample of the recording stands in place of those after it.

    Examples
    --------
    >>> centre, rows = step_samples(5000)
    >>> centre, rows[:, [0, -1]].tolist()
    (array([1152, 3200]), [[128, 2175], [2176, 4223]])
    """
    n_steps = ((n_samples - WINDOW) // HOP + 1) // WINDOWS
    centre = STEP * np.arange(n_steps) + (STEP - HOP + WINDOW) // 2
    rows = centre[:, None] + np.arange(-STEP // 2, STEP // 2)
    return centre, rows.clip(max=n_samples - 1)
