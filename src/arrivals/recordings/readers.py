"""Read a recording from a file of any known format, or take one from numbers."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from arrivals.files import file_error, open_input
from arrivals.measurement_models import SensorArray
from arrivals.measurement_models.arrays.files import given_array
from arrivals.measurements import numbers
from arrivals.recordings.formats.file_contents import (
    MAX_BYTES,
    FileContents,
    ReadingOptions,
    check_size,
)
from arrivals.recordings.formats.registry import HEAD, reader_for
from arrivals.recordings.formats.several_files import (
    check_channels,
    file_names,
    joined,
    raw_layout,
)
from arrivals.recordings.recording import Recording
from arrivals.recordings.stored_samples import StoredSamples
from arrivals.typing import Float
from arrivals.validation import positive

READING = ("rate", "variable", "transpose", "max_bytes", "format")  # of `track` and `check`, too
LOADED_AT_ONCE = 2**26  # bytes of samples that are loaded from the file when it is read: 64 MB


def read(
    path: str | PathLike[str] | Sequence[str | PathLike[str]] | ArrayLike,
    *,
    rate: float | None = None,
    variable: str | None = None,
    transpose: bool = False,
    array: str | PathLike[str] | SensorArray | None = None,
    max_bytes: float = MAX_BYTES,
    rate_required: bool = False,
    format: str | None = None,  # noqa: A002  (the option's name)
) -> Recording:
    """Read a recording from a file, or take one from an array of numbers.

    Parameters
    ----------
    path : str, path, sequence of them, or array_like
        Samples (n_samples, n_channels), masked ones too, or a regular file, or several files of
        equal length whose channels follow each other. The suffix selects the format, or the
        content if the suffix is unknown or wrong:

        - ``.wav``: any bit depth, also RF64. Integers are scaled to [-1, 1).
        - ``.npy``, ``.npz``, ``.mat`` (MATLAB): unchanged numbers.
        - ``.h5``, ``.hdf5`` and ``.mat`` of version 7.3: acoular's ``time_data``, or any dataset.
        - ``.sigmf-meta``, ``.sigmf-data``, ``.sigmf``: with rate and centre frequency.
        - ``.cf32``, ``.cs16``, ``.cs8``, ``.cu8`` and others: raw complex samples (IQ), channels
          interleaved; ``.iq``, ``.bin``, ``.dat`` and ``.raw`` require `format`.
        - ``.sio``: of the Scripps Institution of Oceanography, unchanged numbers.
        - ``.mseed``: traces of one component, on a common grid of time, NaN in gaps.
        - ``.csv``, ``.txt``: one row per sample, separated by commas, semicolons, tabs or spaces;
          real or complex (``1+2j``, ``1+2i``); a cell that is empty, ``nan``, ``None`` or ``NA`` is
          missing. Comments (``#``, ``%``) and one line of headings may precede it; a first column
          ``time`` or ``t`` is in s.

        In a file of named arrays the array may have the name ``samples`` or ``snapshots``
        (complex), with a number ``rate``, ``fs``, ``sample_rate`` or the like in Hz and an array
        ``time`` in s.
    rate : float, optional
        Samples per second, Hz; replaces that of the file.
    variable : str, optional
        Name of the array in a file of named arrays, required if there are several.
    transpose : bool
        True if the rows of the file are channels.
    array : str, path or SensorArray, optional
        Array file, name of a preset, or array. It selects the channels of its sensors, in its
        order, and is the `array` of the recording.
    max_bytes : float
        Largest size of the numbers, decompressed, of a format that is not read in blocks; larger
        ones are refused unread.
    rate_required : bool
        True to refuse real samples without a rate; arrays with a header are not loaded then.
    format : str, optional
        Format of a file without a header, such as cs16; it takes the place of the suffix. The
        number of channels is that of `array`; without an array, or in each of several files, it is
        one. ``cs16:5`` has five channels.

    Returns
    -------
    Recording
        Real samples (float32 if the file has that precision, else float64), or complex
        snapshots, each (n_samples, n_channels). Large ones stay in their file
        (`StoredSamples`), which must not change.

    Raises
    ------
    OSError
        If the file does not exist, cannot be read, or is not a regular file.
    ValueError
        If the file is empty, truncated, too large, of an unknown format, or does not contain one
        array of numbers of one or two dimensions. The message is one line that begins with the
        path.

    Examples
    --------
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = Path(folder, "tone.npz")
    ...     np.savez(path, samples=np.zeros((500, 4)), rate=1000)
    ...     recording = read(path)
    >>> recording.n_channels, recording.rate, recording.duration
    (4, 1000.0, 0.5)
    """
    options = ReadingOptions(variable, transpose, max_bytes, rate_required, format)
    return _read(path, rate, options, given_array(array), select=True)


def read_channels(
    path: Any, array: SensorArray | None, *, rate: float | None = None, **options: Any
) -> Recording:
    """Read all channels of a recording, whether they fit an array or not.

    Parameters
    ----------
    path : str, path, sequence of them, or array_like
        As in `read`.
    array : SensorArray or None
        Number of channels of a file that has no header.
    rate : float, optional
        As in `read`.
    **options : object
        `variable`, `transpose`, `max_bytes` and `format` of `read`.

    Returns
    -------
    Recording
        Without an array.

    Examples
    --------
    >>> read_channels(np.ones((10, 4)), SensorArray.ula(3, spacing=0.5), rate=8.0).n_channels
    4
    """
    return _read(path, rate, ReadingOptions(**options), array, select=False)


def _read(
    path: Any,
    rate: float | None,
    options: ReadingOptions,
    array: SensorArray | None,
    *,
    select: bool,
) -> Recording:
    if rate is not None:
        positive("rate", rate)
    paths, given = file_names(path), options.format or ""
    form, n_channels = raw_layout(options.format, array if len(paths) == 1 else None)
    is_missing = options.rate_required and rate is None
    options = replace(options, rate_required=is_missing, format=form, n_channels=n_channels)
    array = array if select else None
    if not paths:
        contents = FileContents(numbers("samples", path))
        return _recording(contents, rate, options, array)
    several = [_opened(each, options) for each in paths]
    try:
        if ":" in given:
            check_channels([contents for contents, _ in several], n_channels)
        contents = joined([contents for contents, _ in several], paths, transpose=options.transpose)
        recording = _recording(contents, rate, options, array)
    except Exception as error:
        has_name = any(str(error).startswith(f"{each}: ") for each in paths)
        raise error if has_name else file_error(paths[0], error) from error
    for each, (_, notes) in zip(paths, several, strict=True):
        for note in notes:
            warnings.warn(f"{each}: {note}", stacklevel=3)
    return recording


def _opened(path: Path, options: ReadingOptions) -> tuple[FileContents, list[str]]:
    """Return the contents of a regular file, which must not change, and lines for the user."""
    open_input(path).close()  # a regular file that can be read
    stamp = _stamp(path)
    try:
        contents, notes = _contents(path, options)
        if isinstance(contents.array, StoredSamples):
            guarded = _UnchangedFile(path, stamp, contents.array.load)
            contents = contents._replace(array=replace(contents.array, load=guarded))
    except Exception as error:  # parsers raise all kinds of errors on damaged files
        raise file_error(path, error) from error
    return contents, notes


def _contents(path: Path, options: ReadingOptions) -> tuple[FileContents, list[str]]:
    """Return the contents of a file, and lines for the user."""
    with open_input(path) as file:
        head = file.read(HEAD)
    if not head:
        raise ValueError("the file is empty")
    reader, disagreement = reader_for(path, head, options.format)
    if options.variable is not None and not reader.has_names:
        got = f"{options.variable!r} for a {reader.name} file"
        raise ValueError(f"variable must be None without named arrays; got {got}")
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            contents = reader.read(path, options)
    except Exception as error:
        raise ValueError(f"{disagreement}: {error}") if disagreement else error from error
    wrong = disagreement and f"{disagreement}: read as {reader.name}"
    return contents, [note for note in (wrong, contents.note) if note]


def _stamp(path: Path) -> tuple[int, int]:
    status = path.stat()
    return status.st_size, status.st_mtime_ns


@dataclass(frozen=True)
class _UnchangedFile:
    """Loader of rows of a file that must not change after it was opened."""

    path: Path
    stamp: tuple[int, int]
    load: Callable[[int, int], NDArray[Any]]

    def __call__(self, start: int, stop: int) -> NDArray[Any]:
        try:
            rows = self.load(start, stop)
            if _stamp(self.path) != self.stamp:
                raise ValueError("the file changed while it was read")
        except Exception as error:
            changed = not self.path.exists() or _stamp(self.path) != self.stamp
            reason = ValueError("the file changed while it was read") if changed else error
            raise file_error(self.path, reason) from error
        return rows


def _recording(
    contents: FileContents, rate: float | None, options: ReadingOptions, array: SensorArray | None
) -> Recording:
    samples = _in_memory(contents.array, options)
    rate = contents.rate if rate is None else rate
    is_real = samples.dtype.kind != "c"
    if is_real and rate is None and contents.time is not None:
        rate = _rate_of(contents.time)
    options.check(0, is_real, rate is not None)
    time = None if is_real else contents.time
    frequency, names = contents.frequency, contents.names
    recording = Recording(samples, rate, time, frequency=frequency, names=names)
    return recording if array is None else recording.select(array)


def _in_memory(
    samples: NDArray[Any] | StoredSamples, options: ReadingOptions
) -> NDArray[Any] | StoredSamples:
    """Return samples (n_samples, n_channels); few ones are loaded, and those to be transposed."""
    if isinstance(samples, StoredSamples):
        if options.transpose:
            check_size(samples.n_bytes, options.max_bytes)
        elif samples.n_bytes > min(LOADED_AT_ONCE, options.max_bytes):
            return samples
        samples = samples[:]
    samples = samples[:, None] if samples.ndim == 1 else samples
    return samples.T if options.transpose else samples


def _rate_of(time: Float) -> float:
    """Return the rate of evenly spaced times, with a tolerance of a tenth of a step."""
    step = float(time[-1] - time[0]) / max(1, len(time) - 1) if np.all(np.isfinite(time)) else 0.0
    if step <= 0 or np.any(np.abs(time - time[0] - step * np.arange(len(time))) > 0.1 * step):
        raise ValueError("the times of the samples are not evenly spaced: pass rate= in Hz")
    return 1 / step
