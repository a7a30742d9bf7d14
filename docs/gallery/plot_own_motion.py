"""
A motion model of your own
==========================

A buoy swings about its anchor: position and velocity follow a damped spring. Two receivers on the
shore measure bearings. The model is a dataclass of a few lines, and runs in every Gaussian filter.
"""

# %%
# A motion model has the size of the state, the mean of the next state, its Jacobian, and the
# covariance of the noise. `state_names` lets a measurement find its entries.

from dataclasses import dataclass

import matplotlib.pyplot as plt
import numpy as np
from scipy.linalg import expm

from arrivals.measurement_models import Bearing
from arrivals.motion_models import ConstantVelocity, MotionModel
from arrivals.trackers import EKF


@dataclass(frozen=True)
class Mooring(MotionModel):
    """A damped spring in the plane: period in s, damping in 1/s, q in m²/s³."""

    period: float = 60.0
    damping: float = 0.005
    q: float = 0.02
    dim_x = 4
    state_names = ("x", "vx", "y", "vy")
    is_linear = True

    def f(self, x, dt=1.0):
        return np.asarray(x) @ self.F(x, dt).T

    def F(self, x, dt=1.0):
        spring = np.array([[0.0, 1.0], [-((2 * np.pi / self.period) ** 2), -self.damping]])
        return np.kron(np.eye(2), expm(spring * dt))

    def Q(self, dt=1.0):
        return ConstantVelocity(self.q).Q(dt)


# %%
# Two hundred seconds, a bearing of 2 degrees from each receiver every second, and a gap of 40 s.

rng = np.random.default_rng(0)
bearings = Bearing([[-150.0, -200.0], [150.0, -200.0]], noise=np.deg2rad(2.0) ** 2)
mooring = Mooring()
x, truth, z = np.array([60.0, 0.0, -20.0, 3.0]), [], []
for _ in range(200):
    x = mooring.sample(x, rng)
    truth.append(x)
    z.append(bearings.sample(x[[0, 2]], rng))
truth, z = np.array(truth), np.array(z)
z[100:140] = np.nan

# %%
# The filter with the right model goes through the gap; one that expects a constant velocity leaves
# on a tangent.

figure, ax = plt.subplots(figsize=(7, 6), layout="constrained")
ax.plot(truth[:, 0], truth[:, 2], color="black", linewidth=1.5, linestyle=":", label="truth")
for name, motion in (("Mooring", mooring), ("ConstantVelocity", ConstantVelocity(0.5))):
    run = EKF(motion, bearings, x=[50.0, 0.0, 0.0, 0.0], P=np.diag([900.0, 25, 900, 25])).run(z)
    error = np.hypot(*(run.x - truth)[100:140, [0, 2]].T)
    print(f"{name:16} largest error in the gap {error.max():6.1f} m")
    ax.plot(run.x[:, 0], run.x[:, 2], label=name)
ax.set(xlim=(-120, 120), ylim=(-120, 120), aspect="equal", xlabel="x, m", ylabel="y, m")
ax.set_title("A moored buoy by two bearings, 40 s without data")
ax.legend(loc="upper left")
