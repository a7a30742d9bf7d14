"""
Birds on a map, by three recorders
==================================

Three recorders with six microphones each stand 30 m apart. Two birds call in turns and together;
`arrivals.fuse` reads the recordings and a stations file, and chooses frequencies and windows.
"""

# %%
# Simulated recordings: calls between 1 and 2 kHz, delayed to each microphone and attenuated with
# the distance, in noise.

import tempfile
from pathlib import Path

import numpy as np
import scipy.io.wavfile

import arrivals

RATE, SPEED, SECONDS = 8000, 343.0, 8
BIRDS = np.array([[6.0, 14.0], [24.0, 16.0]])
RECORDERS = {"oak": (0.0, 0.0), "brook": (30.0, 0.0), "hut": (15.0, 26.0)}
ANGLES = np.arange(6) * np.pi / 3
MICROPHONES = 0.08 * np.stack([np.cos(ANGLES), np.sin(ANGLES)], axis=1)

rng = np.random.default_rng(0)
n = RATE * SECONDS
frequency = np.fft.rfftfreq(n, 1 / RATE)
calls = []
for first in (0.4, 0.9):
    call = np.fft.rfft(rng.standard_normal(n))
    call[(frequency < 1000) | (frequency > 2000)] = 0
    t = np.arange(n) / RATE
    calls.append(np.fft.irfft(call) * (((t - first) % 2.0) < 1.3))


def received(place):
    """Return the samples of a recorder, (n_samples, n_microphones)."""
    samples = 0.003 * rng.standard_normal((n, len(MICROPHONES)))
    for bird, call in zip(BIRDS, calls, strict=True):
        distance = np.linalg.norm(np.add(place, MICROPHONES) - bird, axis=1)
        delayed = np.fft.rfft(call)[:, None] * np.exp(
            -2j * np.pi * frequency[:, None] * distance / SPEED
        )
        samples += np.fft.irfft(delayed, axis=0) / distance
    return samples


# %%
# A stations file names places, headings, arrays and recordings.

folder = Path(tempfile.mkdtemp())
lines = ["area = [-5, -5, 35, 32]", "speed = 0.5", f"wave_speed = {SPEED}", ""]
for name, place in RECORDERS.items():
    samples = (2e4 * received(place) / 0.5).clip(-32767, 32767).astype(np.int16)
    scipy.io.wavfile.write(folder / f"{name}.wav", RATE, samples)
    lines += [
        "[[station]]",
        f'name = "{name}"',
        f"x_m = {place[0]}",
        f"y_m = {place[1]}",
        "heading_deg = 0.0",
        f'recording = "{name}.wav"',
        f'array = {{kind = "positions", positions = {MICROPHONES.tolist()}, speed = {SPEED}}}',
        "",
    ]
(folder / "stations.toml").write_text("\n".join(lines))

# %%
# One call. What was chosen is in one line.

run = arrivals.fuse(folder / "stations.toml")
print(run.understood)
for bird in BIRDS:
    distance = np.linalg.norm(run.position - bird, axis=-1)
    near = distance < 3.0
    print(bird, "m:", f"{np.median(distance[near]):.2f} m away in {near.any(axis=1).sum()} steps")

# %%
# The map. Both birds are found within a few decimetres.

ax = arrivals.plot(run)
ax.set_title("Two birds, three recorders")
