"""
Our models in filterpy's filters
================================

The bound methods of a model have filterpy's signatures. `as_filterpy` makes the filter; here its
UKF tracks a ship that turns by the bearings of two stations, beside ours.
"""

# %%
# A coordinated turn: position, velocity and turn rate. Two stations measure bearings.

import matplotlib.pyplot as plt
import numpy as np

from arrivals.measurement_models import Bearing
from arrivals.motion_models import CoordinatedTurn
from arrivals.trackers import UKF, as_filterpy

turn = CoordinatedTurn(q=0.02, q_turn=1e-5)
bearing = Bearing([[0.0, 0.0], [800.0, 0.0]], noise=np.deg2rad(1.0) ** 2)
print(turn.state_names)

rng = np.random.default_rng(1)
x, truth, z = np.array([100.0, 6.0, 300.0, 2.0, -0.02]), [], []
for _ in range(120):
    x = turn.sample(x, rng)
    truth.append(x)
    z.append(bearing.for_state(turn.state_names).sample(x, rng))
truth = np.array(truth)

# %%
# filterpy's filter, with our models inside, and our own: the numbers agree.

start, P = np.array([120.0, 0.0, 280.0, 0.0, 0.0]), np.diag([1e3, 50.0, 1e3, 50.0, 1e-3])
theirs = as_filterpy(turn, bearing.for_state(turn.state_names), "ukf", x=start, P=P, dt=1.0)
ours = UKF(turn, bearing, x=start, P=P)
tracks = {"filterpy's UKF": [], "our UKF": []}
for each in z:
    for name, ukf in (("filterpy's UKF", theirs), ("our UKF", ours)):
        ukf.predict()
        ukf.update(each)
        tracks[name].append(np.ravel(ukf.x)[[0, 2]])
apart = np.abs(np.subtract(*map(np.array, tracks.values()))).max()
print(f"the two filters differ by at most {apart:.1e} m")

figure, ax = plt.subplots(figsize=(8, 3.6), layout="constrained")
ax.plot(truth[:, 0], truth[:, 2], color="black", linewidth=0.8, linestyle=":", label="truth")
for (name, track), style in zip(tracks.items(), ("-", "--"), strict=True):
    ax.plot(*np.array(track).T, style, label=name)
ax.plot(*bearing.sensor_positions.T, "k^", label="stations")
ax.set(xlabel="x, m", ylabel="y, m", title="A ship that turns, by two bearings", aspect="equal")
ax.legend(loc="center left", bbox_to_anchor=(1.0, 0.5))
