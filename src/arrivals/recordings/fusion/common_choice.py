"""One choice of frequencies, windows and tracker for recordings of several stations."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from arrivals.measurement_models import SensorArray
from arrivals.recordings.choice import Choice, MeanSpectrum, TrackOptions, choose
from arrivals.recordings.choice.limits import alias_frequency
from arrivals.recordings.recording import Recording


def common_choices(
    recordings: Sequence[Recording], options: Sequence[TrackOptions]
) -> list[Choice]:
    """Return the choice for each recording, the same for those of one rate and the same options.

    It is that of `arrivals.track` for all channels of these recordings together, with the array of
    the lowest alias limit and the length of the shortest.

    Parameters
    ----------
    recordings : sequence of Recording
        With their arrays, which have wave speeds.
    options : sequence of TrackOptions
        Given settings of each.

    Returns
    -------
    list of Choice

    Raises
    ------
    ValueError
        As `choose`.

    Examples
    --------
    >>> array = SensorArray.uca(4, radius=0.1, speed=343.0)
    >>> rng, t = np.random.default_rng(0), np.arange(8000)[:, None] / 8000
    >>> noise = rng.standard_normal((2, 8000, 4))
    >>> tone = 4 * np.cos(2 * np.pi * 700 * t)  # received by one station
    >>> pair = [Recording(noise[0], 8000.0, array=array),
    ...         Recording(noise[1] + tone, 8000.0, array=array)]
    >>> [choice.frequencies for choice in common_choices(pair, [TrackOptions()] * 2)]
    [(699.804,), (699.804,)]
    """
    known = [
        replace(one, frequencies=recording.frequency)
        if recording.is_narrowband and recording.frequency and not one.has_frequencies
        else one
        for recording, one in zip(recordings, options, strict=True)
    ]
    # text of the options: lists among them cannot be hashed
    keys = [
        (each.rate, each.is_narrowband, repr(one))
        for each, one in zip(recordings, known, strict=True)
    ]
    groups = {key: [k for k, other in enumerate(keys) if other == key] for key in keys}
    made = {key: _chosen([recordings[k] for k in groups[key]], known[groups[key][0]])
            for key in groups}  # fmt: skip
    return [made[key] for key in keys]


def _chosen(group: Sequence[Recording], options: TrackOptions) -> Choice:
    array = min((each.array for each in group if each.array is not None), key=_limit)
    rate, length = group[0].rate, min(len(each.samples) for each in group)
    spectrum: MeanSpectrum | None = MeanSpectrum.empty()
    if group[0].is_narrowband:
        spectrum = None
    elif rate is not None and not options.has_frequencies:
        spectrum = pooled([MeanSpectrum.of(each.samples, rate) for each in group])
    return choose(array, rate, spectrum, options, length)


def _limit(array: SensorArray) -> float:
    return alias_frequency(array) if array.n_sensors > 1 else np.inf


def pooled(spectra: Sequence[MeanSpectrum]) -> MeanSpectrum:
    """Return the mean of the spectra that have the bins of the finest.

    Examples
    --------
    >>> pooled([MeanSpectrum(*np.ones((3, 4))), MeanSpectrum.empty()]).power
    array([1., 1., 1., 1.])
    """
    finest = max(spectra, key=lambda one: len(one.frequency))
    alike = [one for one in spectra if np.array_equal(one.frequency, finest.frequency)]
    power = np.mean([one.power for one in alike], axis=0)
    steady = np.mean([one.steady for one in alike], axis=0)
    return MeanSpectrum(finest.frequency, np.asarray(power), np.asarray(steady))
