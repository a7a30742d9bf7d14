"""Rules that choose frequencies, windows and tracker from array, rate and spectrum."""

from __future__ import annotations

import math
import warnings
from dataclasses import replace
from typing import Any

import numpy as np

from arrivals.measurement_models import SensorArray
from arrivals.recordings.choice.limits import SPEECH_STEP_S, BandLimits, power_of_two
from arrivals.recordings.choice.options import NARROWBAND, WIDEBAND, Choice, TrackOptions
from arrivals.recordings.choice.plausibility import implausible_size
from arrivals.recordings.choice.spectrum import MeanSpectrum
from arrivals.recordings.framing import frequencies_in
from arrivals.recordings.narrowband import default_window
from arrivals.typing import Float

N_SNAPSHOTS = 4  # half-overlapping windows in a step of wideband sources below speech
LINE_SNAPSHOTS, LINE_WINDOWS = 2, 4  # in a step of lines; their length in default windows
NEIGHBOURS = 4  # bins of a Hann window that count as one
LEAST_BINS = 8  # of a mixture over bins
STEP_S, SHORTEST_STEP_S, STEPS = 0.128, 0.005, 20  # of complex snapshots
RADIO_STEP_S, SHORTEST_RADIO = 0.020, 200  # of radios: s, and samples in a step of 20 ms at least
POWER_FLOOR, MAX_SNR_DB = 3.0, 20.0  # of svalse on recorded data
RADIO_FLOOR, RADIO_SNR_DB = 1.0, 15.0  # of reduced steps; gains and phases of receivers deviate


def choose(
    array: SensorArray,
    rate: float | None,
    spectrum: MeanSpectrum | None,
    options: TrackOptions | None = None,
    n_samples: int | None = None,
) -> Choice:
    """Complete given settings by settings that fit the array and the recording.

    Parameters
    ----------
    array : SensorArray
        The array.
    rate : float or None
        Rows of the recording per second, Hz.
    spectrum : MeanSpectrum or None
        Spectrum of real samples; None for complex snapshots.
    options : TrackOptions, optional
        Given settings.
    n_samples : int, optional
        Rows of the recording, if known.

    Returns
    -------
    Choice
        Complete.

    Raises
    ------
    ValueError
        If no frequency is usable, or one is required: complex snapshots do not contain theirs.

    Notes
    -----
    Without frequencies and band, real samples of a recording

    - with lines are tracked at these by `svalse`, 2 long windows a step;
    - without, by `wideband_mixture` at all bins of `BandLimits`: windows of 32 ms, every 16 ms,
      steps of 64 ms;
    - below the frequencies of speech, and with direction and range, by `svalse` at all bins, in
      windows of three periods of the lowest, or of 32 ms.

    `svalse` gets settings for recorded data then: snapshots of a step and neighbouring bins are
    tempered, weak sources are left out, and deviations from plane waves count as noise.

    `wideband_mixture` gets its windows and steps at given frequencies, too. With frequencies, or
    a band, and another tracker nothing else is changed: one window a step without overlap.

    Examples
    --------
    >>> array = SensorArray.uca(8, radius=0.046, speed=343.0)
    >>> quiet = MeanSpectrum(np.arange(1.0, 8000.0, 4.0), *np.ones((2, 2000)))
    >>> print(choose(array, 16000.0, quiet))  # doctest: +ELLIPSIS
    wideband sources, 224 bins: --tracker wideband_mixture --band 300 7306.81 --window 512 ...
    """
    options = TrackOptions() if options is None else options
    choice = _choice(array, rate, spectrum, options, n_samples)
    choice = replace(choice, unknowns=options.unknowns, nearest=options.nearest)
    limits = None
    if rate is not None and spectrum is not None and not options.has_frequencies:
        limits = BandLimits.of(array, rate)
    if size := implausible_size(array, choice.frequencies, limits, rate, spectrum):
        warnings.warn(size, stacklevel=2)
    n_bins = len(choice.frequencies)
    if choice.tracker == WIDEBAND and n_bins < LEAST_BINS:
        warnings.warn(
            f"{WIDEBAND} misses most sources with less than {LEAST_BINS} frequencies; got {n_bins}:"
            " pass a wider band, a longer window, or neither frequency nor band",
            stacklevel=2,
        )
    return choice


def _choice(
    array: SensorArray,
    rate: float | None,
    spectrum: MeanSpectrum | None,
    options: TrackOptions,
    n_samples: int | None,
) -> Choice:
    if spectrum is None:
        return _of_snapshots(rate, options, n_samples)
    if rate is None:
        raise ValueError("real samples require a rate: pass their number per second, rate (--rate)")
    if n_samples is not None and options.window is not None and options.window > n_samples:
        raise ValueError(
            f"the recording has {n_samples} samples; one window requires {options.window}: "
            "pass a shorter window"
        )
    if options.frequencies is not None:
        return _of_frequencies(rate, options)
    if options.band is not None:
        limits, lines = BandLimits.given(options.band, rate), np.zeros(0)
        if options.tracker not in (None, WIDEBAND):
            return _of_given_band(rate, options)
    else:
        limits = BandLimits.of(array, rate)
        lines = spectrum.lines(limits.low, limits.high)
    if len(lines) and options.tracker != WIDEBAND:
        choice = _of_lines(lines, rate, options, n_samples)
    else:
        choice = _of_band(limits, rate, options)
    snr_db = spectrum.snr_db(choice.frequencies, limits.low, limits.high)
    return _completed(choice, options, snr_db)


def _of_snapshots(rate: float | None, options: TrackOptions, n_samples: int | None) -> Choice:
    """Choose the number of complex samples in a step: one, or several at a high rate.

    Steps of many samples, as of a radio, are reduced to their covariance.
    """
    if options.band is not None:
        raise ValueError("a band requires real samples; got complex snapshots: pass a frequency")
    if options.frequencies is None:
        raise ValueError(
            "complex snapshots require their frequency, Hz: pass frequencies (--frequency, or "
            "--center of a radio)"
        )
    if options.window is not None or options.hop is not None:
        raise ValueError("window and hop must be None for complex snapshots")
    if options.follow is not None:
        raise ValueError("follow must be None for complex snapshots")
    n = options.snapshots or _snapshots_of_step(rate, n_samples)
    is_radio = n > SHORTEST_RADIO and options.snapshots is None
    if options.snapshots is not None or n < 2 or (options.tracker is not None and not is_radio):
        n = options.snapshots or 1
        reason = "" if options.tracker else f"complex snapshots, {n} a step"
        return replace(_as_given(reason, options, _bins(options)), reduce=options.reduce)
    reduce = is_radio or options.reduce
    choice = Choice(f"complex snapshots, {n} a step", options.tracker or NARROWBAND, _bins(options),
                    n_snapshots=n, settings=dict(options.settings), reduce=reduce)  # fmt: skip
    if options.tracker is not None:
        return choice
    # the few snapshots that stand for a reduced step are not tempered any further
    settings = _recorded(1, RADIO_SNR_DB, RADIO_FLOOR) if reduce else _recorded(n)
    return replace(choice, settings=settings | dict(options.settings))


def _snapshots_of_step(rate: float | None, n_samples: int | None) -> int:
    """Return the number of complex samples in a step of 20 ms, or of 200 up to 128 ms."""
    if rate is None:
        return 1
    step = float(np.clip(SHORTEST_RADIO / rate, RADIO_STEP_S, STEP_S))
    step = step if n_samples is None else min(step, n_samples / rate / STEPS)
    return int(max(step, SHORTEST_STEP_S) * rate)


def _bins(options: TrackOptions) -> tuple[float, ...]:
    return options.frequencies if isinstance(options.frequencies, tuple) else ()


def _of_frequencies(rate: float, options: TrackOptions) -> Choice:
    """Take frequencies as they are given; for the mixture, in steps of speech."""
    n = len(_bins(options))
    if options.tracker == WIDEBAND:
        if options.follow is not None:
            raise ValueError(f"follow requires a tracker of tones; got {WIDEBAND}")
        limits = BandLimits(min(_bins(options)), max(_bins(options)))
        frames = _frames(limits, rate, options, WIDEBAND)
        reason = "wideband sources at given frequencies"
        choice = Choice(reason, WIDEBAND, _bins(options), None, *frames)
        return _completed(choice, options, MAX_SNR_DB)
    noun = "this frequency" if n == 1 else f"these {n} frequencies"
    reason = f"narrowband sources, {noun} alone (wideband ones, such as speech, need none)"
    reason = "" if options.tracker else reason
    if options.follow is None:
        return _as_given(reason, options, _bins(options))
    window = options.window or power_of_two(rate / options.follow)
    followed = replace(options, window=window)
    return replace(_as_given(reason, followed, _bins(options)), follow=options.follow)


def _of_given_band(rate: float, options: TrackOptions) -> Choice:
    """Take all bins of the given band, and the given tracker."""
    frequencies = tuple(frequencies_in(options.band or (), rate, options.window))
    noun = "1 bin" if len(frequencies) == 1 else f"{len(frequencies)} bins together"
    hint = "" if options.snapshots else f" (speech: --tracker {WIDEBAND})"
    return _as_given(f"{options.tracker} at {noun}{hint}", options, frequencies)


def _as_given(reason: str, options: TrackOptions, frequencies: tuple[float, ...]) -> Choice:
    band = None if options.band is None else (float(options.band[0]), float(options.band[1]))
    tracker, n = options.tracker or NARROWBAND, options.snapshots or 1
    framing = options.window, options.hop, n
    return Choice(reason, tracker, frequencies, band, *framing, dict(options.settings))


def _of_lines(lines: Float, rate: float, options: TrackOptions, n_samples: int | None) -> Choice:
    """Choose windows that resolve the lines, and that the recording has."""
    frequencies = tuple(float(f"{each:.6g}") for each in lines)
    apart = float(np.diff(lines).min()) if len(lines) > 1 else np.inf
    wanted = max(LINE_WINDOWS * default_window(rate, min(frequencies)), 4 * rate / apart)
    window = 2 ** math.ceil(math.log2(wanted))
    if n_samples is not None:
        window = min(window, 2 ** int(math.log2(max(4, n_samples / 8))))
    noun = "one spectral line" if len(lines) == 1 else f"{len(lines)} spectral lines"
    tracker = options.tracker or NARROWBAND
    return Choice(noun, tracker, frequencies, None, window, None, LINE_SNAPSHOTS)


def _of_band(limits: BandLimits, rate: float, options: TrackOptions) -> Choice:
    """Choose windows and tracker for all bins of a band."""
    window = _window(limits, rate, options)
    band = (float(f"{limits.low:.6g}"), float(f"{limits.high:.6g}"))
    frequencies = tuple(frequencies_in(band, rate, window))
    is_speech = limits.has_speech and len(frequencies) >= LEAST_BINS
    is_speech &= options.unknowns != "range"
    tracker = options.tracker or (WIDEBAND if is_speech else NARROWBAND)
    reason = f"wideband sources, {len(frequencies)} bins"
    return Choice(reason, tracker, frequencies, band, *_frames(limits, rate, options, tracker))


def _window(limits: BandLimits, rate: float, options: TrackOptions) -> int:
    return options.window or power_of_two(limits.window_duration * rate)


def _frames(
    limits: BandLimits, rate: float, options: TrackOptions, tracker: str
) -> tuple[int, int, int]:
    """Return window, hop and number of windows in a step of wideband sources."""
    window = _window(limits, rate, options)
    hop = options.hop or window // 2
    is_mixture = tracker == WIDEBAND
    return window, hop, max(1, round(SPEECH_STEP_S * rate / hop)) if is_mixture else N_SNAPSHOTS


def _completed(choice: Choice, options: TrackOptions, snr_db: float) -> Choice:
    """Return a choice with the given settings, and those for recorded data if svalse is chosen."""
    window, n = options.window or choice.window or 2, options.snapshots or choice.n_snapshots
    settings: dict[str, Any] = dict(options.settings)
    if options.tracker is None and choice.tracker == NARROWBAND:
        alike = n if choice.band is None else NEIGHBOURS * n
        settings = _recorded(alike, snr_db) | settings
    hop = options.hop or choice.hop or window // 2
    return replace(choice, window=window, hop=hop, n_snapshots=n, settings=settings)


def _recorded(
    n: int, snr_db: float = MAX_SNR_DB, power_floor: float = POWER_FLOOR
) -> dict[str, Any]:
    """Return settings of svalse for recorded data, of which n snapshots count as one."""
    return {
        "solver__tempering": float(n),
        "solver__power_floor": power_floor,
        "solver__max_snr_db": snr_db,
    }
