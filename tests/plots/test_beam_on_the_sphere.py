"""Beam power behind azimuths on the sphere."""

import numpy as np

from arrivals.measurement_models import ArraySnapshot, SensorArray
from arrivals.plots.beam import draw_beam


def test_beam_is_the_highest_over_elevations() -> None:
    from matplotlib.figure import Figure

    model = ArraySnapshot(SensorArray.uca(8, 0.65), 1.0, unknowns="sphere", noise=1e-4)
    doa, elevation = np.full((3, 1), np.deg2rad(40.0)), np.full((3, 1), np.deg2rad(60.0))
    z = model.simulate(doa, np.ones((3, 1)), np.random.default_rng(0), elevation=elevation)
    ax = Figure().subplots()
    draw_beam(ax, np.arange(3.0), z, model, range_db=20.0)
    level = np.asarray(ax.collections[0].get_array()).reshape(-1, 3)
    assert abs(np.argmax(level[:, 0]) * 360 / 361 - 180 - 40) <= 2
    assert level.max() == 0
