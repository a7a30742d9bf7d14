"""
filterpy's filters in our IMM
=============================

A bank of two of filterpy's Kalman filters, one for straight motion and one for turns, mixed by our
`IMM`, which takes any filter with `x`, `P`, `predict` and `update`.
"""

# %%
# Two filters of filterpy that differ in their process noise.

import matplotlib.pyplot as plt
import numpy as np
from filterpy.kalman import KalmanFilter

from arrivals.motion_models import ConstantVelocity
from arrivals.trackers import IMM


def member(q):
    """Return filterpy's filter of a position in the plane, with acceleration noise q."""
    walk, kf = ConstantVelocity(q), KalmanFilter(dim_x=4, dim_z=2)
    kf.F, kf.Q = walk.F(np.zeros(4)), walk.Q(1.0)
    kf.H = np.array([[1.0, 0, 0, 0], [0, 0, 1.0, 0]])
    kf.R = 9.0 * np.eye(2)
    kf.x, kf.P = np.zeros((4, 1)), np.diag([100.0, 25.0, 100.0, 25.0])
    return kf


bank = IMM([member(0.01), member(3.0)], mu=[0.5, 0.5], M=[[0.95, 0.05], [0.1, 0.9]])

# %%
# A target flies straight, turns by 180 degrees, and flies straight again.

heading = np.concatenate([np.zeros(40), np.linspace(0, np.pi, 20), np.full(40, np.pi)])
truth = np.cumsum(5.0 * np.stack([np.cos(heading), np.sin(heading)], axis=1), axis=0)
z = truth + 3.0 * np.random.default_rng(0).standard_normal(truth.shape)

positions, probability = [], []
for each in z:
    bank.predict()
    bank.update(each)
    positions.append(bank.x.ravel()[[0, 2]])
    probability.append(bank.mu[1])
error = np.linalg.norm(np.array(positions) - truth, axis=1)
print(f"median error {np.median(error):.1f} m, of the measurements "
      f"{np.median(np.linalg.norm(z - truth, axis=1)):.1f} m")  # fmt: skip

# %%
# The probability of the manoeuvring filter rises in the turn.

figure, (ax, below) = plt.subplots(2, figsize=(7, 5.5), layout="constrained")
ax.plot(*z.T, ".", color="grey", markersize=4, label="measurements")
ax.plot(*truth.T, color="black", linewidth=0.8, linestyle=":", label="truth")
ax.plot(*np.array(positions).T, label="IMM of filterpy's filters")
ax.set(xlabel="x, m", ylabel="y, m", title="A turn", aspect="equal")
ax.legend(loc="center left")
below.plot(probability)
below.set(xlabel="step", ylabel="probability of turning", ylim=(0, 1))
