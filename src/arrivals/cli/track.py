"""The main job of the command line: a recording or a stream in, a tracks file and a picture out."""

from __future__ import annotations

import argparse
import inspect
import os
import sys
import warnings
from collections.abc import Callable, Iterable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any, TypeAlias, get_type_hints

import numpy as np

from arrivals.cli.separated_signals import check_suffix
from arrivals.measurement_models import ArraySamples, ArraySnapshot, SensorArray
from arrivals.recordings.framing import frequencies_in, live_looks, looks
from arrivals.recordings.readers import read
from arrivals.recordings.recording import Recording
from arrivals.recordings.sample_stream import band_samples, live_samples, track_samples
from arrivals.recordings.stream import track_live
from arrivals.trackers import Tracker, find
from arrivals.trackers.run import Run, header, text
from arrivals.typing import Complex, Float
from arrivals.validation import count

Bar: TypeAlias = Callable[..., Any]


def track(arguments: argparse.Namespace, bar: Bar) -> None:
    """Track directions through the recording, or the stream, that the arguments name.

    Parameters
    ----------
    arguments : argparse.Namespace
        Those of `arrivals track`.
    bar : callable
        Takes the steps, and gives them back while it shows how far it is, as tqdm does.

    Raises
    ------
    ValueError, TypeError, OSError
        If something is wrong with the arguments, the files or the stream. No output file has been
        made then, or changed.
    """
    from threadpoolctl import threadpool_limits

    from arrivals.cli.track_sources import separates, track_sources

    array = SensorArray.from_toml(arguments.array)
    _check_outputs(arguments)
    with threadpool_limits(1, "blas"):  # the matrices are small: more threads only wait
        if separates(arguments):
            track_sources(arguments, array, bar)
        elif arguments.band and _takes_samples(arguments.tracker):
            _track_band(arguments, array, bar)
        else:
            _track_snapshots(arguments, array, bar)


def _takes_samples(name: str) -> bool:
    """Tell whether a tracker's measurements are real samples, not complex snapshots."""
    try:
        hints = get_type_hints(find(name).__init__)
    except (NameError, TypeError):  # somebody else's, with types that cannot be read
        return False
    return hints.get("measurement") is ArraySamples


def _track_snapshots(arguments: argparse.Namespace, array: SensorArray, bar: Bar) -> None:
    count("snapshots", arguments.snapshots)
    job = _track_stream if arguments.file == "-" else _track_file
    job(arguments, array, bar)


def _frequencies(arguments: argparse.Namespace, rate: float | None) -> list[float]:
    """Return the frequencies wanted, Hz: one, several, or those that fill a band."""
    given = [arguments.frequency, arguments.frequencies, arguments.band]
    if sum(each is not None for each in given) > 1:
        raise ValueError("give one of --frequency, --frequencies and --band")
    if arguments.band:
        if rate is None:
            raise ValueError("--band needs the samples per second: pass --rate")
        return frequencies_in(arguments.band, rate, arguments.window)
    if arguments.frequencies:
        return [float(each) for each in arguments.frequencies]
    if arguments.frequency is None:
        raise ValueError("give --frequency, or --band for a tracker of real samples")
    return [arguments.frequency]


def model_at(
    array: SensorArray, arguments: argparse.Namespace, frequencies: list[float]
) -> ArraySnapshot:
    """Return the array at its frequencies; a line at a single one must be unambiguous."""
    if array.speed is None:
        raise ValueError(
            f"{arguments.array}: the key 'speed' is missing: "
            "a frequency wants the speed of the waves, m/s"
        )
    wavelengths = [array.wavelength(each) for each in frequencies]
    limit = array.alias_limit
    if limit is not None and len(wavelengths) == 1 and wavelengths[0] < limit * (1 - 1e-6):
        raise ValueError(
            f"frequency must not exceed the array's alias limit, {array.speed / limit:g} Hz, at "
            f"which its grid spacing is half the wavelength; got {frequencies[0]:g} Hz. "
            "Several --frequencies may go beyond it"
        )
    return ArraySnapshot(array, wavelengths, n_snapshots=arguments.snapshots)


def _tracker(
    name: str, measurement: ArraySnapshot | ArraySamples, settings: dict[str, Any]
) -> Tracker:
    """Make a tracker of directions, its parameters changed by (nested) names."""
    kind = find(name)
    known = inspect.signature(kind).parameters
    if "measurement" not in known:
        raise ValueError(f"the tracker {name!r} takes no measurement: it cannot track an array's "
                         "snapshots")  # fmt: skip
    for setting in settings:
        if setting.partition("__")[0] == "measurement":
            raise ValueError(f"--set {setting}: the measurement comes from --array and --frequency")
    needs = [key for key, value in known.items() if value.default is value.empty]
    if needs != ["measurement"]:
        raise ValueError(
            f"the tracker {name!r} is made from {', '.join(needs)}, not from an array file alone"
        )
    plain = {key: value for key, value in settings.items() if key in known}
    with _warnings_told():
        tracker = kind(**{"measurement": measurement} | plain)
        return kind(**tracker.set_params(**settings).get_params(deep=False))


@contextmanager
def _warnings_told() -> Iterator[None]:
    """Tell each warning in one line on standard error, once."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        yield
    for told in dict.fromkeys(str(each.message) for each in caught):
        print(f"arrivals: warning: {told}", file=sys.stderr)


def _check_outputs(arguments: argparse.Namespace) -> None:
    """Refuse, before the work begins, what could not be written at its end."""
    from arrivals.plots.bearing_time import picture_format

    outputs = arguments.out, arguments.plot, arguments.signals
    files = [name for name in (arguments.array, arguments.file, *outputs) if name and name != "-"]
    if len({Path(name).resolve() for name in files}) < len(files):
        raise ValueError("FILE, --array, --out, --plot and --signals must be different files")
    for name in filter(None, outputs):
        folder = Path(name).parent
        if not folder.is_dir():
            raise FileNotFoundError(2, "the folder does not exist", str(folder))
        if Path(name).is_dir():
            raise IsADirectoryError(21, "this is a folder", name)
        if not os.access(folder, os.W_OK):
            raise PermissionError(13, "the folder may not be written to", str(folder))
    if arguments.plot:
        picture_format(arguments.plot)
    if arguments.signals:
        check_suffix(arguments.signals)


def refuse(arguments: argparse.Namespace, names: Iterable[str], reason: str) -> None:
    """Raise a ValueError if one of these arguments was given."""
    for name in names:
        if getattr(arguments, name):
            raise ValueError(f"--{name} {reason}")


@dataclass(frozen=True)
class _Heard:
    """The snapshots of the array's sensors, and their times, s, if they are known."""

    values: Complex
    time: Float | None


def _heard(arguments: argparse.Namespace, recording: Recording, frequencies: list[float]) -> _Heard:
    """Find the snapshots of the array's sensors in a recording."""
    found = looks(recording, frequencies, window=arguments.window, hop=arguments.hop,
                  n_snapshots=arguments.snapshots)  # fmt: skip
    values = found.values
    if not np.isfinite(values).any():
        raise ValueError(f"{arguments.file}: no sample of the array's channels is finite")
    return _Heard(values, found.time if np.isfinite(found.time).all() else None)


def _track_file(arguments: argparse.Namespace, array: SensorArray, bar: Bar) -> None:
    if arguments.band is None:  # what is wrong with the arguments is told before the file is read
        measurement = model_at(array, arguments, _frequencies(arguments, None))
        tracker = _tracker(arguments.tracker, measurement, dict(arguments.set))
    refuse(arguments, ("dtype", "channels"), "goes with samples from standard input")
    recording = read(arguments.file, rate=arguments.rate, variable=arguments.variable,
                     transpose=arguments.transpose, array=array)  # fmt: skip
    frequencies = _frequencies(arguments, recording.rate)
    if arguments.band:
        measurement = model_at(array, arguments, frequencies)
        tracker = _tracker(arguments.tracker, measurement, dict(arguments.set))
    heard = _heard(arguments, recording, frequencies)
    result = tracker.run(bar(heard.values, desc=arguments.tracker))
    result = result if heard.time is None else result.at(heard.time)
    if arguments.out:
        result.to_csv(arguments.out)
    else:
        print_rows(result)
    if arguments.plot:
        _plot(arguments.plot, result, heard, measurement)


def print_rows(result: Run) -> None:
    """Print the tracks file."""
    sys.stdout.write(",".join(header(result.kind)) + "\n")
    for row in result.rows():
        sys.stdout.write(",".join(text(row)) + "\n")


def _plot(path: str, result: Run, heard: _Heard, measurement: ArraySnapshot) -> None:
    from arrivals.plots.bearing_time import plot_bearing_time, save

    ax = plot_bearing_time(result, snapshots=heard.values, measurement=measurement, time=heard.time)
    save(ax, path)


def _track_stream(arguments: argparse.Namespace, array: SensorArray, bar: Bar) -> None:
    frequencies = _frequencies(arguments, arguments.rate)
    measurement = model_at(array, arguments, frequencies)
    tracker = _tracker(arguments.tracker, measurement, dict(arguments.set))
    refuse(arguments, ("plot", "variable", "transpose"), "goes with a file, not with a stream")
    snapshots = live_looks(
        sys.stdin.buffer, _stream_channels(arguments.channels, array), frequencies,
        n_snapshots=arguments.snapshots, dtype=arguments.dtype or "int16", rate=arguments.rate,
        window=arguments.window, hop=arguments.hop,
    )  # fmt: skip
    steps = ((time, array.select(z)) for time, z in snapshots)
    with _live_output(arguments.out) as write:
        track_live(tracker, bar(steps, desc=arguments.tracker), write)


def _track_band(arguments: argparse.Namespace, array: SensorArray, bar: Bar) -> None:
    """Track by a tracker that takes real samples one by one, from a recording or a stream."""
    refuse(
        arguments, ("frequency", "frequencies", "window"), "goes with snapshots, not with --band"
    )
    if arguments.snapshots != 1:
        raise ValueError("--snapshots goes with snapshots, not with a tracker of real samples")
    if arguments.file == "-":
        _track_band_stream(arguments, array, bar)
        return
    refuse(arguments, ("dtype", "channels"), "goes with samples from standard input")
    recording = read(arguments.file, rate=arguments.rate, variable=arguments.variable,
                     transpose=arguments.transpose, array=array)  # fmt: skip
    if recording.is_narrowband:
        raise ValueError(f"{arguments.file}: --band wants real samples; these are complex")
    tracker, rate = _band_tracker(arguments, array, recording.rate)
    samples = bar(recording.samples, desc=arguments.tracker)
    result = track_samples(tracker, samples, rate, every=arguments.hop or 1)
    if arguments.out:
        result.to_csv(arguments.out)
    else:
        print_rows(result)
    if arguments.plot:
        from arrivals.plots.bearing_time import plot_bearing_time, save

        save(plot_bearing_time(result, time=result.time), arguments.plot)


def _track_band_stream(arguments: argparse.Namespace, array: SensorArray, bar: Bar) -> None:
    refuse(arguments, ("plot", "variable", "transpose"), "goes with a file, not with a stream")
    tracker, rate = _band_tracker(arguments, array, arguments.rate)
    n_channels = _stream_channels(arguments.channels, array)
    frames = live_samples(sys.stdin.buffer, n_channels, dtype=arguments.dtype or "int16")
    steps = ((k / rate, array.select(z)) for k, z in enumerate(frames))
    with _live_output(arguments.out) as write:
        bars = bar(steps, desc=arguments.tracker)
        if track_live(tracker, bars, write, every=arguments.hop or 1) == 0:
            raise ValueError("the stream ended before one sample of every channel")


def _band_tracker(
    arguments: argparse.Namespace, array: SensorArray, rate: float | None
) -> tuple[Tracker, float]:
    """Return the tracker of a source that fills the band, and the rate."""
    if rate is None:
        raise ValueError("--band needs the samples per second: pass --rate")
    measurement = band_samples(array, rate, arguments.band, arguments.snr)
    return _tracker(arguments.tracker, measurement, dict(arguments.set)), rate


def _stream_channels(channels: int | None, array: SensorArray) -> int:
    """Return how many channels a stream has: what was said, or what the array tells."""
    wired = array.n_sensors if array.channels is None else max(array.channels) + 1
    if channels is None and array.n_channels is None and wired > array.n_sensors:
        raise ValueError("the array file names some channels of a larger stream: pass --channels")
    given = channels if channels is not None else array.n_channels or array.n_sensors
    array.select(np.empty(count("channels", given)))
    return given


@contextmanager
def _live_output(path: str | None) -> Iterator[Callable[[str], object]]:
    """Give what writes lines at once, to standard output or to a file that the first ones make."""
    if path is None:
        yield lambda lines: (sys.stdout.write(lines), sys.stdout.flush())
        return
    with ExitStack() as stack:
        opened = cache(lambda: stack.enter_context(open(path, "wb", buffering=0)))
        yield lambda lines: opened().write(lines.encode())
