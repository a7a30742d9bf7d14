"""
Missing data
============

NaN and None are missing measurements. The numbers that are there are used, a gap lets the
deviations grow, and a track ends when its existence falls below one half.
"""

# %%
# One walking source on 15 sensors, 10 dB.

import matplotlib.pyplot as plt
import numpy as np

from arrivals.plots import plot_bearing_time
from arrivals.scenarios import create

trial = create("walk", snr_db=10.0, n_steps=80).sample(np.random.default_rng(3))

# %%
# Five sensors fail at step 15, three steps are missing from step 40, and twenty from step 55.

z = trial.measurements.copy()
z[15:, [1, 4, 8, 9, 13]] = np.nan
z[40:43] = np.nan
z[55:75] = np.nan

run = trial.tracker("svalse").run(z)
print("steps without a source:", np.flatnonzero(run.n_found == 0))

# %%
# The deviation of the component: larger with ten sensors, and growing in the gaps.

std = np.rad2deg(np.nanmin(run.std, axis=1, initial=np.inf))
print(
    f"median std {np.median(std[:15]):.2f} degrees by 15 sensors, {np.median(std[15:40]):.2f} by 10"
)

figure, (above, below) = plt.subplots(
    2, sharex=True, figsize=(8, 6), height_ratios=(2, 1), layout="constrained"
)
ax = plot_bearing_time(run, ax=above)
above.plot(np.rad2deg(trial.truth), color="black", linewidth=0.8, linestyle=":")
above.set(xlabel="", ylim=(-75, -45), yticks=np.arange(-75, -44, 10))
above.set_title("One source; sensors and steps are missing; truth dotted")
below.plot(std, color="black")
below.set(xlabel="step", ylabel="stated std, degrees", ylim=(0, 2.5))
for start, stop, text in ((15, 80, "10 of 15 sensors"), (40, 43, ""), (55, 75, "no data")):
    for each in (above, below):
        each.axvspan(start - 0.5, stop - 0.5, color="grey", alpha=0.15, linewidth=0)
    above.text(start, -74.5, f" {text}", va="bottom")
