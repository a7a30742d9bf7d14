"""
More sources than a beamformer separates
========================================

Three sources on three sensors: no subspace method has a dimension left for noise. Their spectra
differ, though, and a Kalman filter on autoregressive models separates directions and signals.
"""

# %%
# Sources of order two, each with its own resonance.

import matplotlib.pyplot as plt
import numpy as np

from arrivals.scenarios import create
from arrivals.trackers import MUSIC

trial = create("ar_three_on_three").sample(np.random.default_rng(0))
print(trial.measurements.shape, "snapshots, sensors;", trial.truth.shape[1], "sources")
try:
    MUSIC(trial.measurement, n_sources=3)
except ValueError as error:
    print("MUSIC:", error)

# %%
# The tracker starts a few degrees away.

tracker = trial.tracker("ar_kalman_qrd_rls", doa=trial.truth[0] + np.deg2rad([3.0, -3.0, 3.0]))
run = tracker.run(trial.measurements)
for k in range(3):
    found, true = run.signals[-1000:, k], trial.signals[-1000:, k]
    gain = np.vdot(found, true) / np.vdot(found, found)
    left = np.mean(abs(true - gain * found) ** 2) / np.mean(abs(true) ** 2)
    doa = np.rad2deg(run.doa[-1, k])
    print(f"source {k + 1}: {doa:6.1f} degrees, error of the signal {10 * np.log10(left):5.1f} dB")

# %%
# Directions over all snapshots, and forty samples of each signal at the end.

figure, axes = plt.subplots(4, figsize=(8, 8), layout="constrained", height_ratios=(2, 1, 1, 1))
axes[0].plot(np.rad2deg(run.doa))
axes[0].plot(np.rad2deg(trial.truth), color="black", linewidth=0.8, linestyle=":")
axes[0].set(xlabel="snapshot", ylabel="direction, degrees", ylim=(-90, 90))
axes[0].set_title("Three sources on three sensors; truth dotted")
for k, ax in enumerate(axes[1:]):
    at = np.arange(len(run) - 40, len(run))
    ax.plot(at, trial.signals[at, k].real, color="black", linestyle=":", label="true signal")
    ax.plot(at, run.signals[at, k].real, color=f"C{k}", label="separated")
    ax.set(ylabel=f"signal {k + 1}")
    ax.margins(x=0)
axes[-1].set_xlabel("snapshot")
axes[1].legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=2, frameon=False)
