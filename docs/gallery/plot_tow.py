"""
A tow past a vertical line of hydrophones
=========================================

Sound of one source reaches 63 hydrophones by several paths over surface and bottom. Each path has
its own elevation, appears, moves and disappears.
"""

# %%
# The shipped snapshots: a simulation of the SWellEx-96 experiment at 198 Hz. Here are 150 of the
# 350 steps, the closest approach among them.

import numpy as np

from arrivals.plots import plot_bearing_time
from arrivals.scenarios.demos.swellex96 import swellex96
from arrivals.trackers import create

model, snapshots, time = swellex96()
part = slice(180, 330)
print(model.array.n_sensors, "sensors,", len(snapshots[part]), "steps of 10.9 s")

# %%
# One line makes the tracker: nothing is given but the array and the wavelength.

run = create("svalse", measurement=model).run(snapshots[part])
print(f"{run.n_found.mean():.1f} directions a step, {1e3 * run.elapsed / len(run):.1f} ms a step")

# %%
# Positive elevations come from above. Near the closest approach, at some 3200 s, the wavefronts are
# curved over the 118 m of the array, and plane waves fit one path as two or three.

ax = plot_bearing_time(run, snapshots=snapshots[part], measurement=model, time=time[part])
ax.set(ylim=(-50, 50), yticks=np.arange(-45, 46, 15), ylabel="elevation, degrees")
ax.set_title("SWellEx-96 tow, simulated: tracks of svalse")
