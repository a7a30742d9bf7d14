"""
A tracker of your own
=====================

A class of thirty lines: the phase step between neighbouring sensors, smoothed on the circle. It
gets runs, labels, tracks files and plots from its base class.
"""

# %%
# A tracker of directions has `n_slots`, `predict`, `update`, and calls `report` with the
# directions that it found, `reset` with none. A registered name makes it available to `create`, to
# Monte Carlo studies and to the command line.

import numpy as np

from arrivals.measurement_models import ArraySnapshot
from arrivals.plots import plot_bearing_time
from arrivals.scenarios import create
from arrivals.trackers import DirectionTracker, register
from arrivals.trackers.conformance import check_tracker
from arrivals.validation import no_control, time_step


@register("phase_step")
class PhaseStep(DirectionTracker):
    """One direction on a uniform line: the angle of a forgetting mean of z[m+1] z[m]*."""

    n_slots = 1

    def __init__(self, measurement: ArraySnapshot, forgetting: float = 0.7):
        self.measurement, self.forgetting = measurement, forgetting
        self.mean = 0j
        self.reset()

    def predict(self, u=None, *, dt=1.0):
        no_control(u)
        self.mean = self.mean * self.forgetting ** time_step(dt)
        self.reset()

    def update(self, z):
        y = np.nan_to_num(self.measurement.snapshot(z))  # a missing sensor counts as zero
        step = np.vdot(y[:-1], y[1:])
        if step != 0:
            self.mean = self.mean + step
            array, wavelength = self.measurement.array, self.measurement.wavelengths[0]
            spacing = array.positions[1, 0] - array.positions[0, 0]
            sine = np.angle(self.mean) * wavelength / (2 * np.pi * spacing)
            self.report([np.arcsin(np.clip(sine, -1, 1))])


# %%
# The conformance checks try gaps, NaN, invalid arguments, copies, pickles and more.

trial = create("walk", snr_db=10.0, n_steps=120).sample(np.random.default_rng(4))
check_tracker(lambda: PhaseStep(trial.measurement), trial.measurements[:6])
print("passed all checks")

# %%
# It tracks one source at 10 dB.

run = trial.tracker("phase_step").run(trial.measurements)
error = np.rad2deg(run.doa - trial.truth)
print(f"median error {np.nanmedian(np.abs(error)):.2f} degrees")
ax = plot_bearing_time(run, snapshots=trial.measurements, measurement=trial.measurement)
ax.plot(np.rad2deg(trial.truth), color="black", linewidth=0.8, linestyle=":")
ax.set_title("phase_step on a walking source, 10 dB; truth dotted")
