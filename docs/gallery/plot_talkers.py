"""
Talkers in a room
=================

Two talkers, of whom one walks, and reverberation of 0.25 s. Each bin of the spectrum holds one
talker or diffuse sound; `wideband_mixture` shares them out.
"""

# %%
# Six microphones on a circle with a radius of 4.6 cm; voices are two synthetic ones that ship with
# the package.

import numpy as np

from arrivals.plots import plot_bearing_time
from arrivals.scenarios import create, mean_gospa

scene = create("room", n_talkers=2, n_moving=1, rt60=0.25, voices="shipped", n_bins=48)
trial = scene.sample(np.random.default_rng(2))
print(trial.measurements.shape, "steps of 128 ms, frequencies, windows, microphones")

# %%
# The number of talkers is estimated; a talker that pauses keeps its label.

run = trial.tracker("wideband_mixture").run(trial.measurements)
score = mean_gospa(np.rad2deg(trial.truth), np.rad2deg(run.doa), c=20.0, period=360.0)
print(f"labels {np.unique(run.label[run.label >= 0])}, GOSPA {score.total:.1f} degrees")

time = 0.128 * (np.arange(len(run)) + 0.5)
ax = plot_bearing_time(run, time=time)
ax.plot(time, np.rad2deg(trial.truth), color="black", linewidth=0.8, linestyle=":")
ax.set_title("Two talkers in a room, reverberation 0.25 s; truth dotted, missing in pauses")
