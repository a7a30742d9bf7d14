"""
Positions from signal strength
==============================

Three emitters walk through a network of 100 sensors, which measure nothing but power. They pass
each other near the middle.
"""

# %%
# Every sensor receives the sum of the three; `rss_vb` explains all readings together.

import numpy as np

from arrivals.plots import plot_map
from arrivals.scenarios import create

scene = create("rss_crossing", n_sources=3)
trial = scene.sample(np.random.default_rng(1))
print(trial.measurements.shape, "steps, sensors")

run = trial.tracker("rss_vb").run(trial.measurements)

# %%
# The order of the sources is that of the truth here, as the tracker was given where they start.

error = np.linalg.norm(run.position - trial.truth, axis=-1)
print(f"median error {np.median(error):.2f} m, {1e3 * run.elapsed / len(run):.0f} ms a step")

ax = plot_map(run, sensors=trial.measurement.sensors, truth=trial.truth, n_ellipses=5)
ax.set_title("Three emitters by the power at 100 sensors")
