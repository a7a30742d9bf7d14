"""
Sources that cross
==================

Of six sources two cross. A method without memory loses sources near the crossing and elsewhere;
one that carries densities from step to step does not.
"""

# %%
# Figure 4 of the paper on SVALSE: 15 sensors, 50 steps, 20 dB.

import matplotlib.pyplot as plt
import numpy as np

from arrivals.plots import plot_bearing_time
from arrivals.scenarios import create, mean_gospa

trial = create("svalse_fig4").sample(np.random.default_rng(0))

# %%
# The same snapshots by three methods. GOSPA counts the errors of the estimates that belong to a
# source, and 5 degrees for each source that is missed and each estimate that is false.

figure, axes = plt.subplots(3, sharex=True, figsize=(8, 9), layout="constrained")
for name, ax in zip(("cbf", "valse", "svalse"), axes, strict=True):
    run = trial.tracker(name).run(trial.measurements)
    score = mean_gospa(np.rad2deg(trial.truth), np.rad2deg(run.doa), c=10.0)
    plot_bearing_time(run, ax=ax)
    ax.plot(np.rad2deg(trial.truth), color="black", linewidth=0.8, linestyle=":")
    ax.set_title(f"{name}: GOSPA {score.total:.1f} degrees; truth dotted")
    print(f"{name:7} {score.total:5.1f}, missed {score.missed:.1f}, false {score.false:.1f}")

for ax in axes[:-1]:
    ax.set_xlabel("")
