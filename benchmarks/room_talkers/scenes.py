"""Talkers in rooms by pyroomacoustics' image sources, with voices of espeak-ng where installed."""

from __future__ import annotations

import shutil
import subprocess
from dataclasses import dataclass, replace
from functools import cache
from typing import Literal

import numpy as np
from scipy.signal import resample_poly

from arrivals.scenarios.room_acoustics.layouts import SIZE, RoomLayout
from arrivals.scenarios.room_acoustics.speech_signals import RATE, Utterance
from arrivals.scenarios.simulations.rooms import SPEED, RoomRecording, TalkersInRoom
from arrivals.typing import Float

ArrayName = Literal["circle", "line", "square"]
ARRAYS: tuple[ArrayName, ...] = ("circle", "line", "square")
KINDS = {"one": (1, 0), "two": (2, 0), "move": (1, 1), "two_move": (2, 1)}  # talkers, moving
CONDITIONS = ("nominal", "gains", "diffuse")
GAIN_DB, PLACE_M, DIFFUSE_DB = 1.0, 1e-3, 10.0
FILTER_DELAY = 40  # samples, of pyroomacoustics' fractional delays
VOICES = ("en-us", "en-gb+f3", "de+f2", "fr+m5", "es+f4", "it+m1", "nl+m4", "en-us+f5")
SENTENCES = (
    "The ferry leaves the harbour at ten, unless the fog is too thick.",
    "We planted four apple trees behind the house in early spring.",
    "Turn left after the bridge, then follow the road along the canal.",
    "The museum is closed on Mondays, but its garden is always open.",
    "She packed the tent, two blankets and enough food for a week.",
    "His watch was eight minutes slow, so he missed the first train.",
)


@dataclass(frozen=True)
class ReferenceRoom(TalkersInRoom):
    """`TalkersInRoom` with pyroomacoustics' responses, all reflections, and spoken sentences."""

    condition: str = "nominal"

    def layout(self, rng: np.random.Generator) -> RoomLayout:
        """Draw a layout; with condition "gains" the sensors are off by 1 mm in each coordinate."""
        layout = super().layout(rng)
        error = rng.standard_normal(layout.sensors.shape) * PLACE_M * (self.condition == "gains")
        return replace(layout, sensors=layout.sensors + error)

    def responses(self, layout: RoomLayout, talker: int) -> list[Float]:
        """Return responses by image sources up to the order that pyroomacoustics states."""
        import pyroomacoustics as pra

        settings = {"max_order": 0}
        if self.rt60:
            absorption, order = pra.inverse_sabine(self.rt60, SIZE, c=SPEED)
            settings = {"max_order": order, "materials": pra.Material(absorption)}
        room = pra.ShoeBox(SIZE, fs=int(RATE), **settings)
        room.set_sound_speed(SPEED)
        for place in layout.places[talker]:
            room.add_source(place)
        room.add_microphone_array(layout.sensors.T)
        room.compute_rir()
        n = max(len(h) for sensor in room.rir for h in sensor)
        responses = np.zeros((len(layout.places[talker]), n, len(layout.sensors)))
        for m, sensor in enumerate(room.rir):
            for k, h in enumerate(sensor):
                responses[k, : len(h), m] = h
        return list(responses[:, FILTER_DELAY:])

    def voice(self, talker: int, rng: np.random.Generator) -> Utterance:
        """Return a voice of espeak-ng, or part of a shipped recording without it."""
        if shutil.which("espeak-ng") is None:
            return replace(self, voices="shipped").own_voice(talker, rng)
        name = VOICES[2 * int(rng.integers(len(VOICES) // 2)) + talker % 2]

        def utter(n_samples: int, rng: np.random.Generator) -> Float:
            return spoken(name, SENTENCES[rng.integers(len(SENTENCES))])[:n_samples]

        return utter

    def own_voice(self, talker: int, rng: np.random.Generator) -> Utterance:
        """Return a voice of the scenario."""
        return super().voice(talker, rng)

    def record(self, rng: np.random.Generator) -> RoomRecording:
        """Draw a recording; with condition "gains" those of the channels are off by 1 dB."""
        recording = super().record(rng)
        spread = GAIN_DB * (self.condition == "gains")
        gains = 10 ** (spread * rng.standard_normal(recording.samples.shape[1]) / 20)
        return replace(recording, samples=recording.samples * gains)


@cache
def spoken(voice: str, sentence: str) -> Float:
    """Return a sentence by espeak-ng at 16 kHz, of power 1, without silence at its ends."""
    command = ["espeak-ng", "-v", voice, "-s", "165", "--stdout", sentence]
    wav = subprocess.run(command, check=True, capture_output=True).stdout
    rate = int.from_bytes(wav[24:28], "little")  # the stated length of a pipe is not valid
    x = resample_poly(np.frombuffer(wav[44:], dtype="<i2") / 2**15, int(RATE), rate)
    loud = np.flatnonzero(np.abs(x) > 0.02 * np.abs(x).max())
    x = x[loud[0] : loud[-1] + 1]
    return np.asarray(x / np.sqrt(np.mean(x**2)))


@dataclass(frozen=True)
class RoomCase:
    """One scene of the benchmark: its settings and its seed."""

    array: ArrayName
    kind: str
    rt60: float
    seed: int
    condition: str

    @property
    def scene(self) -> ReferenceRoom:
        """The scene; signal-to-noise ratios of 20 and 10 dB in turn."""
        talkers, moving = KINDS[self.kind]
        turn = ARRAYS.index(self.array) + list(KINDS).index(self.kind) + self.seed
        snr_db = (20.0, 10.0)[(turn + round(4 * self.rt60)) % 2]
        diffuse = DIFFUSE_DB if self.condition == "diffuse" else None
        return ReferenceRoom(
            self.array, talkers, moving, self.rt60, snr_db=snr_db, diffuse_snr_db=diffuse,
            condition=self.condition,
        )  # fmt: skip

    def record(self) -> RoomRecording:
        """Draw the recording, the same talkers and places under every condition."""
        key = [self.seed, ARRAYS.index(self.array), list(KINDS).index(self.kind)]
        return self.scene.record(np.random.default_rng(key))
