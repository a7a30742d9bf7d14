"""
Are the stated deviations true?
===============================

A tracker states a standard deviation and a probability of existence for each source. Both can be
checked where the truth is known: count how many errors lie within, and how many sources exist.
"""

# %%
# Four sources that walk, at 10 dB and at 0 dB, eight draws each.

import matplotlib.pyplot as plt
import numpy as np
from scipy.stats import norm

from arrivals.plots import plot_reliability
from arrivals.scenarios import create, reliability
from arrivals.scenarios.metrics import coverage, matches


def statements(snr_db):
    """Return errors and deviations of the matched estimates, and existences with their truth."""
    error, std, existence, hit = [], [], [], []
    for seed in range(8):
        trial = create("walk", n_sources=4, snr_db=snr_db).sample(np.random.default_rng(seed))
        run = trial.tracker("svalse").run(trial.measurements)
        found = ~np.isnan(run.doa)
        pairs = matches(np.rad2deg(trial.truth), np.rad2deg(run.doa), c=10.0)
        near = np.zeros(run.doa.shape, dtype=bool)
        near[pairs.step, pairs.slot] = True
        error.extend(np.deg2rad(pairs.error))
        std.extend(run.std[pairs.step, pairs.slot])
        existence.extend(run.existence[found])
        hit.extend(near[found])
    return np.array(error), np.array(std), np.array(existence), np.array(hit)


# %%
# The share of errors within an interval, over the share that the interval states; and the share of
# true estimates over the stated existence. On the diagonal both are right.

figure, (left, right) = plt.subplots(1, 2, figsize=(10, 5), layout="constrained")
levels = np.linspace(0.05, 0.99, 20)
for snr_db in (10.0, 0.0):
    error, std, existence, hit = statements(snr_db)
    inside = [coverage(error, std, level) for level in levels]
    plot_reliability(reliability(existence, hit).table, label=f"{snr_db:.0f} dB", ax=right)
    colour = right.containers[-1].lines[0].get_color()
    left.plot(levels, inside, color=colour, marker="o", markersize=4, label=f"{snr_db:.0f} dB")
    within = coverage(error, std, 2 * norm.cdf(1) - 1)
    print(f"{snr_db:4.0f} dB: {100 * within:.0f} % of the errors within one std")
left.plot([0, 1], [0, 1], color="black", linewidth=0.8, linestyle=":")
left.set(xlabel="stated share of errors within", ylabel="observed share", title="Deviations")
left.legend(loc="upper left")
right.set_title("Existence")
right.legend(loc="lower right")
