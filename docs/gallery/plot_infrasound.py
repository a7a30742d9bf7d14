"""
Infrasound on four microphones, recorded
========================================

Twenty minutes in Utah: wind, a short signal from the north-west, a long one from the
west-south-west, then the first direction again. The speed of the waves along the ground is not
known, and is integrated out.
"""

# %%
# The shipped recording, in steps of five frequencies and three overlapping windows.

import numpy as np

from arrivals.motion_models import BernoulliVonMises
from arrivals.plots import plot_bearing_time
from arrivals.scenarios.demos.infrasound import brp2012
from arrivals.trackers import SVALSE, NewtonSolver

measurement, steps, time = brp2012()
print(steps.shape, "steps, frequencies, windows, microphones")

# %%
# Settings for recorded data: windows overlap, so that four snapshots count as one (`tempering`);
# gusts of wind are below the power floor; four sensors resolve two sources at most.

solver = NewtonSolver(tempering=4.0, power_floor=3.0, max_components=2)
motion = BernoulliVonMises(sigma_doa=np.deg2rad(3.0), still=0.1)
run = SVALSE(measurement, motion, solver=solver).run(steps)

# %%
# Azimuths are clockwise from north. Several estimators agree on 320 degrees (-40) at 420 to 435 s,
# 250 (-110) at 610 to 800 s, and 321 (-39) at 805 to 895 s.

for start, stop in ((420, 435), (610, 800), (805, 895)):
    inside = (time >= start) & (time <= stop)
    strongest = np.nanargmax(np.where(np.isnan(run.doa), -1, np.abs(run.amplitude)), axis=1)
    doa = run.doa[np.arange(len(run)), strongest][inside]
    print(f"{start} to {stop} s: median {np.rad2deg(np.nanmedian(doa)) % 360:.0f} degrees")

ax = plot_bearing_time(run, time=time)
ax.set_ylabel("azimuth from north, degrees")
ax.set_title("Infrasound, BRP array, 9 April 2012")
