"""Snapshots of recordings beside scipy's transform, and reading beside soundfile's blocks."""

from __future__ import annotations

import atexit
import tempfile
from pathlib import Path

import numpy as np
from scipy.signal import ShortTimeFFT
from scipy.signal.windows import hann

from arrivals.recordings import Recording, read
from arrivals.typing import Float
from peer_jobs import Job

RATE, N_CHANNELS, WINDOW, BLOCK = 16000, 8, 512, 65536


def jobs(seconds: int = 30, minutes: float = 60.0) -> list[Job]:
    """Return snapshots of 20 frequencies, without and with overlap, and the reading of a file."""
    samples = np.random.default_rng(0).standard_normal((seconds * RATE, N_CHANNELS))
    spectra = [_spectra(samples, hop) for hop in (WINDOW, WINDOW // 2)]
    return [*spectra, _reading(minutes)]


def _spectra(samples: Float, hop: int) -> Job:
    recording = Recording(samples, RATE)
    frequencies = [k * RATE / WINDOW for k in range(10, 30)]
    transform = ShortTimeFFT(hann(WINDOW, sym=False), hop, RATE, phase_shift=None)
    n = (len(samples) - WINDOW) // hop + 1

    def peer() -> object:
        first = transform.m_num_mid
        return transform.stft(samples, 0, n, k_offset=first, axis=0)[10:30]

    return Job(
        f"snapshots of 20 frequencies, 8 channels, 30 s, hop {hop}",
        lambda: recording.snapshots(frequencies, window=WINDOW, hop=hop),
        peer,
        "scipy, one ShortTimeFFT",
        1.0,
    )


def _reading(minutes: float) -> Job:
    import soundfile

    folder = tempfile.TemporaryDirectory()
    atexit.register(folder.cleanup)
    path = Path(folder.name, "recording.wav")
    rng = np.random.default_rng(0)
    minute = (3000 * rng.standard_normal((60 * RATE, N_CHANNELS))).astype(np.int16)
    with soundfile.SoundFile(path, "w", RATE, N_CHANNELS, "PCM_16") as file:
        for _ in range(round(minutes)):
            file.write(minute)

    def ours() -> None:
        samples = read(path).samples
        for start in range(0, len(samples), BLOCK):
            samples[start : start + BLOCK]

    def peer() -> None:
        for _ in soundfile.blocks(path, BLOCK, dtype="float32", always_2d=True):
            pass

    return Job(f"read WAV, {minutes:g} min x 8 channels, in blocks", ours, peer, "soundfile", 1.2)
