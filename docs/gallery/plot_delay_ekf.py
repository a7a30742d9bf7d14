"""
One source that fills a band
============================

A source of noise between 0.15 and 0.35 of the sampling rate moves past ten sensors. There is no
single frequency to work at: the interpolation-delay filter tracks the delay between neighbouring
sensors, sample by sample.
"""

# %%
# Real samples, 400 of them, at 5 dB, from 20 to 60 degrees.

import matplotlib.pyplot as plt
import numpy as np

from arrivals.motion_models import DelayDrift, DelayWalk
from arrivals.scenarios import create
from arrivals.trackers import InterpolationEKF

scene = create("interpolation_band", doa_deg=20.0, end_deg=60.0, n_steps=400)
trial = scene.sample(np.random.default_rng(0))
print(trial.measurements.dtype, trial.measurements.shape, "samples, sensors")

# %%
# The motion model matters. A walk of the delay lags behind a source that moves steadily, and its
# stated deviation does not contain the lag. With the rate of the delay as a second entry of the
# state the filter follows.

motions = {
    "delay, q = 1e-5": DelayWalk(q=1e-5),
    "delay, q = 1e-4": DelayWalk(q=1e-4),
    "delay and its rate": DelayDrift(q=1e-8),
}
figure, ax = plt.subplots(figsize=(8, 4.5), layout="constrained")
ax.plot(np.rad2deg(trial.truth), color="black", linewidth=0.8, linestyle=":", label="truth")
for name, motion in motions.items():
    tracker = InterpolationEKF(trial.measurement, motion, variant="C", doa=np.deg2rad(20.0))
    run = tracker.run(trial.measurements)
    doa, std = np.rad2deg(run.doa[:, 0]), np.rad2deg(run.std[:, 0])
    late = tracker.latency  # an estimate refers to the sample of so many steps ago
    error = doa[50 + late :] - np.rad2deg(trial.truth[50 : len(doa) - late, 0])
    print(f"{name:18}: RMS error {np.sqrt(np.mean(error**2)):.2f} degrees")
    (line,) = ax.plot(doa, label=name)
    ax.fill_between(range(len(doa)), doa - std, doa + std, color=line.get_color(), alpha=0.2)
ax.set(xlabel="sample", ylabel="direction of arrival, degrees", ylim=(0, 80))
ax.set_title("Ten sensors, noise between 0.15 and 0.35 of the rate, 5 dB; bands: ± 1 std")
ax.legend(loc="lower right")
