"""
Direction and range near the array
==================================

Sixteen microphones 8 cm apart receive two sources nearby and one far away. From the curvature of
the wavefronts `svalse` estimates ranges; a plane wave has an infinite one.
"""

# %%
# `unknowns="range"` adds the second unknown; `nearest` is the smallest range, m.

import numpy as np

import arrivals
from arrivals.measurement_models import ArraySnapshot, SensorArray
from arrivals.trackers import create

line = SensorArray.ula(16, spacing=0.08, speed=343.0)
model = ArraySnapshot(
    line, line.wavelength(2000.0), n_snapshots=4, noise=1e-2, unknowns="range", nearest=0.3
)

# %%
# One source passes in front of the array, one stands at 2 m, one is far away.

n = 40
x = np.linspace(-0.8, 0.8, n)
doa = np.stack([np.arctan2(x, 0.6), np.full(n, -1.0), np.full(n, 1.0)], axis=1)
distance = np.stack([np.hypot(x, 0.6), np.full(n, 2.0), np.full(n, np.inf)], axis=1)
rng = np.random.default_rng(0)
amplitude = np.exp(2j * np.pi * rng.random((n, 4, 3)))
run = create("svalse", measurement=model).run(
    model.simulate(doa, amplitude, rng, distance=distance)
)

# %%
# Directions above, ranges below, with bands of one standard deviation.

middle = run.estimate(n // 2)
for angle, far, std in zip(middle.doa, middle.range, middle.range_std, strict=True):
    print(f"{np.rad2deg(angle):6.1f} degrees, {far:5.2f} ± {std:.2f} m")
ax = arrivals.plot(run)
ax.figure.suptitle("One source passes, one stands at 2 m, one is far away")
