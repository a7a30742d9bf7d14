"""Classes of estimates by the unknowns of a source."""

from __future__ import annotations

from arrivals.measurement_models.direction_measurement import DirectionMeasurement
from arrivals.trackers.direction_estimates import RangeEstimate, SphereEstimate
from arrivals.trackers.estimates import DirectionEstimate

KINDS = {"azimuth": DirectionEstimate, "sphere": SphereEstimate, "range": RangeEstimate}


def kind_of_estimate(
    measurement: DirectionMeasurement, tracker: str, *unknowns: str
) -> type[DirectionEstimate]:
    """Return the class of a tracker's estimates, by the unknowns of a source.

    Parameters
    ----------
    measurement : DirectionMeasurement
        Model of a tracker.
    tracker : str
        Name for the message of the error.
    *unknowns : str
        What the tracker can estimate: "azimuth", "sphere", "range".

    Returns
    -------
    type of DirectionEstimate

    Raises
    ------
    ValueError
        If the tracker cannot estimate the unknowns of the model.

    Examples
    --------
    >>> from arrivals.measurement_models import ArraySnapshot, SensorArray
    >>> kind_of_estimate(ArraySnapshot(SensorArray.uca(5, 0.4), 1.0), "SBL", "azimuth").__name__
    'DirectionEstimate'
    """
    wanted = getattr(measurement, "unknowns", "azimuth")
    if wanted not in unknowns:
        able = " or ".join(map(repr, unknowns))
        raise ValueError(f"{tracker} requires unknowns={able}; got {wanted!r}")
    return KINDS[wanted]
