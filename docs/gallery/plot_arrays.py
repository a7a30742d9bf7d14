"""
Known hardware, drawn
=====================

The geometry of common arrays is known by name. A drawing shows which sensor is number 1, where 0
degrees are, and in which sense directions grow: look at it before you trust a direction.
"""

# %%
# All names: `arrivals list` prints them, too.

import matplotlib.pyplot as plt

from arrivals.measurement_models import SensorArray
from arrivals.measurement_models.arrays.presets import preset_names
from arrivals.plots import plot_array

print(*preset_names())

# %%
# Five of them, and a line of your own.

names = ("respeaker-4mic", "respeaker-6mic", "matrix-voice", "uma-16", "ps3-eye")
arrays = {name: SensorArray.from_file(name) for name in names}
arrays["line, 5 cm apart"] = SensorArray.ula(5, spacing=0.05, speed=343.0)

figure, axes = plt.subplots(2, 3, figsize=(11, 7.5), layout="constrained")
for ax, (name, array) in zip(axes.flat, arrays.items(), strict=True):
    plot_array(array, ax=ax)
    ax.set_title(f"{name}: {array.n_sensors} sensors", fontsize=10)
