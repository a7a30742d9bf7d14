"""
Compare trackers by Monte Carlo
===============================

Every method gets the same draws of a scene, and is scored by the same metric; intervals are by
bootstrap. More runs narrow the intervals.
"""

# %%
# Figure 6 of the paper on SVALSE, shortened to 15 steps: pairs of six sources end and begin. Three
# draws at each of three signal-to-noise ratios.

from arrivals.plots import plot_metric
from arrivals.scenarios import create, monte_carlo

scenes = [create("svalse_fig6", n_steps=15, snr_db=snr) for snr in (10.0, 15.0, 20.0)]
study = monte_carlo(scenes, ["cbf", "ssbl", "valse", "svalse"], runs=3, seed=0)

# %%
# Means over runs, and how often one method is better than another on the same data.

for method in study.methods:
    means = [study.mean("gospa", method, case) for case in study.cases]
    print(f"{method:7}", *(f"{mean:6.2f}" for mean in means))
paired = study.paired("gospa", "svalse", "valse", study.cases[0])
print("svalse below valse at 10 dB in", paired.n_below, "of 3 runs")

ax = plot_metric(study, "gospa", x="snr_db")
