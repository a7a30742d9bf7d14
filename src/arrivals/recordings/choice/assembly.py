"""Measurement model and tracker of a choice."""

from __future__ import annotations

import inspect
from collections.abc import Mapping, Sequence
from typing import Any, get_type_hints

from arrivals.measurement_models import ArraySamples, ArraySnapshot, SensorArray
from arrivals.measurement_models.manifolds.two_unknowns import Unknowns
from arrivals.recordings.choice.options import NARROWBAND, Choice
from arrivals.trackers import Tracker, find


def measurement_at(
    array: SensorArray,
    frequencies: Sequence[float],
    n_snapshots: int = 1,
    unknowns: Unknowns = "azimuth",
    nearest: float | None = None,
) -> ArraySnapshot:
    """Return the measurement model at frequencies; a line at one frequency must be unambiguous.

    Parameters
    ----------
    array : SensorArray
        An array with a wave speed.
    frequencies : sequence of float
        Hz.
    n_snapshots : int
        Snapshots in a step.
    unknowns : {"azimuth", "sphere", "range"}
        Unknowns of a source, as in `ArraySnapshot`.
    nearest : float, optional
        Distance of the nearest source, m.

    Returns
    -------
    ArraySnapshot

    Raises
    ------
    ValueError
        If the one frequency is above the alias limit of a line, or the array cannot resolve the
        unknowns.

    Examples
    --------
    >>> measurement_at(SensorArray.ula(4, 0.05, speed=343.0), [1000.0, 2000.0]).shape
    (2, 4)
    """
    wavelengths = [array.wavelength(each) for each in frequencies]
    limit = array.alias_limit
    if limit is not None and len(wavelengths) == 1 and wavelengths[0] < limit * (1 - 1e-6):
        raise ValueError(
            "frequency must not exceed the array's alias limit, "
            f"{array.wavelength(1.0) / limit:g} Hz, at which its grid spacing is half the "
            f"wavelength; got {frequencies[0]:g} Hz. Several, frequencies (--frequencies), may"
        )
    return ArraySnapshot(
        array, wavelengths, n_snapshots=n_snapshots, unknowns=unknowns, nearest=nearest
    )


def takes_samples(name: str | None) -> bool:
    """Return True if a tracker's measurements are real samples, not complex snapshots.

    Parameters
    ----------
    name : str or None
        Registered name; None for one that is to be chosen.

    Returns
    -------
    bool

    Examples
    --------
    >>> takes_samples("interpolation_ekf"), takes_samples("svalse")
    (True, False)
    """
    if name is None:
        return False
    try:
        hints = get_type_hints(find(name).__init__)
    except (NameError, TypeError):  # of another package, with types that cannot be resolved
        return False
    return hints.get("measurement") is ArraySamples


def make_tracker(
    name: str, measurement: ArraySnapshot | ArraySamples, settings: Mapping[str, Any]
) -> Tracker:
    """Return a direction tracker with settings by (nested) names.

    Parameters
    ----------
    name : str
        Registered name.
    measurement : ArraySnapshot or ArraySamples
        The measurement model.
    settings : mapping of str to object
        Parameters of the tracker, as in `set_params`.

    Returns
    -------
    Tracker

    Raises
    ------
    ValueError, TypeError
        If the tracker requires more than a measurement model, or a setting is invalid.

    Examples
    --------
    >>> measurement = measurement_at(SensorArray.ula(4, 0.05, speed=343.0), [1000.0])
    >>> make_tracker("svalse", measurement, {"motion__p_activate": 0.2}).motion.p_activate
    0.2
    """
    kind = find(name)
    parameters = inspect.signature(kind).parameters
    if "measurement" not in parameters:
        raise ValueError(
            f"the tracker {name!r} has no parameter 'measurement': it cannot track snapshots"
        )
    for setting in settings:
        if setting.partition("__")[0] == "measurement":
            raise ValueError(
                f"{setting}: the measurement comes from array (--array) and frequencies"
            )
    required = [key for key, value in parameters.items() if value.default is value.empty]
    if required != ["measurement"]:
        raise ValueError(
            f"the tracker {name!r} requires {', '.join(required)}, not an array file alone"
        )
    plain = {key: value for key, value in settings.items() if key in parameters}
    tracker = kind(**{"measurement": measurement} | plain)
    return kind(**tracker.set_params(**settings).get_params(deep=False))


def assembled(
    array: SensorArray, choice: Choice, rate: float | None
) -> tuple[ArraySnapshot, Tracker]:
    """Return measurement model and tracker of a choice.

    A tracker with a parameter `step_duration` gets the time between steps.

    Parameters
    ----------
    array : SensorArray
        The array.
    choice : Choice
        Frequencies, windows and tracker.
    rate : float or None
        Samples per second, Hz.

    Returns
    -------
    measurement : ArraySnapshot
    tracker : Tracker

    Examples
    --------
    >>> array = SensorArray.ula(4, 0.05, speed=343.0)
    >>> choice = Choice("a tone", "svalse", (1000.0,), window=64, n_snapshots=4)
    >>> assembled(array, choice, rate=8000.0)[0].shape
    (4, 4)
    """
    if takes_samples(choice.tracker):
        raise ValueError(
            f"the tracker {choice.tracker!r} takes real samples of a band: pass band (--band)"
        )
    n_rows = choice.n_rows(array.n_sensors)
    two = choice.unknowns, choice.nearest
    measurement = measurement_at(array, choice.frequencies, n_rows, *two)
    settings = dict(choice.settings)
    hop = choice.hop or choice.window
    if hop and rate and "step_duration" in inspect.signature(find(choice.tracker)).parameters:
        settings = {"step_duration": hop * choice.n_snapshots / rate} | settings
    tracker = make_tracker(choice.tracker, measurement, settings)
    if choice.unknowns != "azimuth" and getattr(tracker.estimate, "n_unknowns", 1) == 1:
        raise ValueError(
            f"the tracker {choice.tracker!r} estimates one angle a source; unknowns "
            f"{choice.unknowns!r} (--unknowns) requires another, such as {NARROWBAND}"
        )
    return measurement, tracker
