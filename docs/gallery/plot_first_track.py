"""
A first track
=============

Fifteen sensors receive three sources, of which one moves. `svalse` estimates how many there are,
where they are, and how certain each direction is.
"""

# %%
# An array, and a model of its snapshots: half a wavelength between the sensors, noise of variance
# 0.01 at each of them, which is 20 dB below a source of amplitude 1.

import numpy as np

from arrivals.measurement_models import ArraySnapshot, SensorArray
from arrivals.plots import plot_bearing_time
from arrivals.trackers import create

array = SensorArray.ula(15, spacing=0.5)
model = ArraySnapshot(array, wavelength=1.0, noise=0.01)

# %%
# Sixty snapshots. The first source moves from -40 to 15 degrees, the third ends after step 40.

steps = np.arange(60)
truth = np.deg2rad(np.stack([-40 + 55 * steps / 59, np.full(60, 30.0), np.full(60, -60.0)], axis=1))
amplitude = np.ones((60, 3), dtype=complex)
amplitude[40:, 2] = 0.0
rng = np.random.default_rng(0)
amplitude *= np.exp(2j * np.pi * rng.random((60, 3)))
snapshots = model.simulate(truth, amplitude, rng)

# %%
# The loop of filterpy: predict, update, read the estimate.

tracker = create("svalse", measurement=model)
for z in snapshots[:20]:
    tracker.predict()
    tracker.update(z)
estimate = tracker.estimate
for label, doa, std, existence in zip(
    estimate.label, estimate.doa, estimate.std, estimate.existence, strict=True
):
    print(f"{label}: {np.rad2deg(doa):6.2f} ± {np.rad2deg(std):.2f} degrees, {existence:.3f}")

# %%
# `run` is the same loop, with its results as arrays over time. Behind the tracks is the power of
# the conventional beamformer.

run = create("svalse", measurement=model).run(snapshots)
ax = plot_bearing_time(run, snapshots=snapshots, measurement=model)
ax.set_title("Three sources, one moves, one ends; 20 dB")
