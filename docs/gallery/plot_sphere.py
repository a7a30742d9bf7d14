"""
Azimuth and elevation
=====================

Sixteen sensors on a square receive three sources in the sky: two cross in azimuth, one passes the
zenith. `unknowns="sphere"` makes the elevation a second unknown of each source.
"""

# %%
# The scene has its own model: ten snapshots a step, 20 dB.

import numpy as np

from arrivals.plots import plot_sky
from arrivals.scenarios import create

trial = create("sphere", array="ura4").sample(np.random.default_rng(0))
print(trial.measurement.unknowns, trial.measurement.shape, "snapshots, sensors")
run = trial.tracker("svalse").run(trial.measurements)

# %%
# `covariance` is that of elevation and of the azimuth along its circle: near the zenith the
# deviation of the azimuth is large, though the direction is certain.

last = run.estimate(len(run) - 1)
for label, azimuth, elevation, C in zip(
    last.label, last.doa, last.elevation, last.covariance, strict=True
):
    std = np.rad2deg(np.sqrt(np.diagonal(C)))
    print(f"{label}: azimuth {np.rad2deg(azimuth):6.1f}, elevation {np.rad2deg(elevation):4.1f}, "
          f"± {std[0]:.2f} and {std[1]:.2f} degrees")  # fmt: skip

# %%
# The sky: zenith in the middle, horizon outside, a ring at the end of each track.

ax = plot_sky(run)
ax.set_title("Sources in the sky, square of 4 by 4 sensors, 20 dB")
