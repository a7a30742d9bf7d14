"""Words about the two unknowns of a source that a measurement model has."""

from __future__ import annotations

import numpy as np

from arrivals.measurement_models import ArraySnapshot
from arrivals.measurement_models.arrays.sphere import azimuth_elevation
from arrivals.measurement_models.manifolds.two_unknowns import fraunhofer_distance
from arrivals.trackers.beamforming.sphere_grid import half_space_normal


def unknowns_in_words(measurement: ArraySnapshot) -> str:
    """Return in one line what is estimated of a source, and by which model of its waves.

    Parameters
    ----------
    measurement : ArraySnapshot
        Model with two unknowns a source.

    Returns
    -------
    str

    Examples
    --------
    >>> from arrivals.measurement_models import SensorArray
    >>> unknowns_in_words(ArraySnapshot(SensorArray.uca(8, 0.3), 1.0, unknowns="sphere"))
    'azimuth and elevation, in the upper half space alone: a planar array has no other'
    """
    if measurement.unknowns == "sphere":
        normal = half_space_normal(measurement)
        if normal is None:
            return "azimuth and elevation"
        azimuth, elevation = np.rad2deg(azimuth_elevation(normal)).round() + 0.0
        side = f"the half space about azimuth {azimuth:g}, elevation {elevation:g} degrees"
        half = "the upper half space" if elevation == 90 else side
        return f"azimuth and elevation, in {half} alone: a planar array has no other"
    limit = fraunhofer_distance(measurement.waves) / 4
    nearest = measurement.nearest or limit
    waves = (
        "spherical waves" if nearest < limit else "plane waves unless the data support curved ones"
    )
    return f"direction and range: {waves}, sources at {nearest:.3g} m or more (--nearest)"
