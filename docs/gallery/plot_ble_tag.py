"""
A Bluetooth tag by the RSSI of gateways
=======================================

A log has one row a reading: a time, a gateway, a level in dBm. `arrivals.locate` reads it, chooses
steps and the loss exponent, and tracks the tag.
"""

# %%
# Simulated readings: a tag walks through a hall of 40 m by 25 m with twelve gateways, which receive
# it about once a second. The loss exponent is 2.4, shadowing 3 dB.

import csv
import tempfile
from pathlib import Path

import numpy as np

import arrivals

rng = np.random.default_rng(5)
folder = Path(tempfile.mkdtemp())
places = [(x, y) for x in (2, 14, 26, 38) for y in (2, 12, 23)]
gateways = {f"gw{i:02d}": place for i, place in enumerate(places)}
with (folder / "gateways.csv").open("w", newline="") as file:
    csv.writer(file).writerows([("gateway", "x_m", "y_m"), *((k, *v) for k, v in gateways.items())])


def place(t):
    """Return the position of the tag at a time, m."""
    return np.array([20 + 15 * np.cos(2 * np.pi * t / 90), 12.5 + 8 * np.sin(4 * np.pi * t / 90)])


rows = []
for t in range(90):
    for name, position in gateways.items():
        if rng.random() < 0.9:
            distance = np.linalg.norm(place(t) - position)
            level = -45 - 24 * np.log10(max(distance, 0.5)) + 3 * rng.standard_normal()
            rows.append((round(t + rng.uniform(0, 0.2), 2), name, round(level)))
with (folder / "tag.csv").open("w", newline="") as file:
    csv.writer(file).writerows([("time_s", "gateway", "rssi_dbm"), *rows])

# %%
# One call; `understood` says what was chosen.

located = arrivals.locate(folder / "tag.csv", folder / "gateways.csv")
print(located.understood)
truth = np.array([place(t) for t in located.run.time])[:, None]
error = np.linalg.norm(located.run.position - truth, axis=-1)
print(f"median error {np.nanmedian(error):.1f} m")

ax = arrivals.plot(located, truth=truth)
ax.set_title("A tag by the RSSI of twelve gateways")
