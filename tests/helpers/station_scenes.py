"""Stations that receive walking sources: recordings, stations files, tables of bearings."""

from collections.abc import Mapping
from functools import cache
from pathlib import Path

import numpy as np
from scipy.io import wavfile
from scipy.signal import butter, sosfilt

from arrivals.measurement_models import SensorArray
from arrivals.typing import Float

RATE, SPEED = 8000, 343.0
ARRAY = SensorArray.uca(8, radius=0.2, speed=SPEED)
PLACES = {"mast": (4.0, 5.0), "roof": (27.0, 8.0), "gate": (14.0, 27.0)}
HEADINGS = {"mast": 37.0, "roof": -110.0, "gate": 200.0}  # degrees
BAND, FINE = (500.0, 1500.0), 16  # Hz, of the sources; steps of their waveforms in a sample
DURATION = 6.0


def path_of(time: Float, source: int = 0) -> Float:
    """Return the positions (n, 2), m, of a source."""
    start, velocity = (((8.0, 10.0), (0.2, 0.5)), ((20.0, 14.0), (0.3, -0.2)))[source]
    return np.asarray(np.array(start) + time[:, None] * np.array(velocity))


@cache
def noise_of(source: int) -> Float:
    """Return noise in a band, from time -1 s on, in fine steps."""
    rng, fine = np.random.default_rng(source), FINE * RATE
    band = butter(3, BAND, "bandpass", fs=fine, output="sos")
    noise = sosfilt(band, rng.standard_normal(round((DURATION + 4) * fine)))
    return np.asarray(noise / noise.std())


def waveform(source: int, time: Float) -> Float:
    """Return the signal of a source at any times, by linear interpolation."""
    noise = noise_of(source)
    return np.interp((time + 1) * FINE * RATE, np.arange(len(noise)), noise)


def samples_at(name: str, start: float = 0.0, n_sources: int = 1, duration: float = DURATION,
               noise: float = 0.05) -> Float:  # fmt: skip
    """Return samples (n_samples, n_sensors) from a time on, s; each source is noise in a band."""
    rng = np.random.default_rng([list(PLACES).index(name), n_sources])
    time = start + np.arange(round(duration * RATE)) / RATE
    turn = np.deg2rad(HEADINGS[name])
    x, y = ARRAY.positions.T
    sensors = np.stack([np.cos(turn) * x - np.sin(turn) * y, np.sin(turn) * x + np.cos(turn) * y])
    samples = noise * rng.standard_normal((len(time), ARRAY.n_sensors))
    for source in range(n_sources):
        away = path_of(time, source) - PLACES[name]
        distance = np.linalg.norm(away, axis=1, keepdims=True)
        # a sensor nearer to the source receives earlier
        retarded = time[:, None] - (distance - away / distance @ sensors) / SPEED
        samples += 0.3 * waveform(source, retarded) * (10 / distance)
    return samples


def stations_file(folder: Path, recorded: bool = True, head: str = "",
                  more: Mapping[str, str] = {}) -> Path:  # fmt: skip
    """Write a stations file, with an array file and names of recordings if they are recorded."""
    (folder / "array.toml").write_text(
        f'kind = "uca"\nn_sensors = 8\nradius = 0.2\nspeed = {SPEED}\n'
    )
    text = head + "\n"
    for name, (x, y) in PLACES.items():
        text += f'[[station]]\nname = "{name}"\nx_m = {x}\ny_m = {y}\n'
        text += f"heading_deg = {HEADINGS[name]}\n"
        if recorded:
            text += f'array = "array.toml"\nrecording = "{name}.wav"\n'
        text += more.get(name, "") + "\n"
    path = folder / "stations.toml"
    path.write_text(text)
    return path


def wav_files(folder: Path, starts: Mapping[str, float] = {}, n_sources: int = 1) -> list[Path]:
    """Write a WAV file a station, which begins at its start, s."""
    paths = []
    for name in PLACES:
        samples = samples_at(name, starts.get(name, 0.0), n_sources)
        paths.append(folder / f"{name}.wav")
        wavfile.write(paths[-1], RATE, (0.3 * samples).astype(np.float32))
    return paths


def bearing_rows(n_steps: int = 12, n_sources: int = 1, std_deg: float = 1.0,
                 seed: int = 0) -> list[tuple[float, str, float]]:  # fmt: skip
    """Return rows time, station, bearing in degrees from the heading, one step a second."""
    rng = np.random.default_rng(seed)
    rows = []
    for time in np.arange(float(n_steps)):
        for name, place in PLACES.items():
            for source in range(n_sources):
                dx, dy = path_of(np.array([time]), source)[0] - place
                azimuth = np.rad2deg(np.arctan2(dy, dx)) + rng.normal(0, std_deg)
                rows.append((float(time), name, float(azimuth - HEADINGS[name])))
    return rows
