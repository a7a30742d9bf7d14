"""
Transmitters on a map, by four arrays
=====================================

Four circles of eight antennas receive three transmitters at 433 MHz. Their phases need not agree:
each station finds directions by itself, and `fused` shares the bearings out to tracks.
"""

# %%
# A simulated scene: one square kilometre, ten snapshots a second at each station. The second
# transmitter ends after about 40 s, the third begins after 8 to 19 s.

import numpy as np

from arrivals.plots import plot_map
from arrivals.scenarios import create

scene = create("stations_radio", n_sources=3, snr_db=15.0)
trial = scene.sample(np.random.default_rng(2))

# %%
# A station is an array at a place, with a heading. The measurement of a step has one entry for
# each of them; None is a station without data.

for station in trial.stations:
    print(station.name, station.position.round(), f"{np.rad2deg(station.heading):.0f} degrees")

tracker = trial.tracker("fused")
run = tracker.run(trial.measurements)
print(f"{run.n_found.max()} sources, {1e3 * run.elapsed / len(run):.0f} ms a step")

# %%
# Each row of the estimate has a label, a position with its covariance, a velocity, a probability
# of existence, and the weight with which each station's bearings were used.

last = tracker.estimate
for label, position, velocity, existence in zip(
    last.label, last.position, last.velocity, last.existence, strict=True
):
    print(label, position.round(1), "m", velocity.round(1), "m/s", f"existence {existence:.4f}")

# %%
# Tracks with 95 % ellipses, the true paths dotted.

ax = plot_map(run, stations=trial.stations, truth=trial.truth, n_ellipses=6)
ax.set_title("Three transmitters, four arrays, 15 dB")
