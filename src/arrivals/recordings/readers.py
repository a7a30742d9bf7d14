"""Readers of recording files: WAV, NumPy, MATLAB and text."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Mapping, Sequence
from os import PathLike
from pathlib import Path
from typing import BinaryIO, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from arrivals.files import file_error, open_input
from arrivals.measurement_models import SensorArray
from arrivals.measurements import numbers
from arrivals.recordings.formats.file_contents import (
    MAX_BYTES,
    FileContents,
    StoredArray,
    check_size,
)
from arrivals.recordings.formats.matlab import matlab_arrays
from arrivals.recordings.formats.numpy_files import numpy_arrays
from arrivals.recordings.formats.text_table import read_text
from arrivals.recordings.formats.wav import read_wav
from arrivals.recordings.recording import Recording
from arrivals.typing import Float
from arrivals.validation import positive

RATES = ("rate", "fs", "Fs")  # names of a scalar with the rate


def read(
    path: str | PathLike[str] | ArrayLike,
    *,
    rate: float | None = None,
    variable: str | None = None,
    transpose: bool = False,
    array: SensorArray | None = None,
    max_bytes: float = MAX_BYTES,
    rate_required: bool = False,
) -> Recording:
    """Read a recording from a file, or take one from an array of numbers.

    Parameters
    ----------
    path : str, path or array_like
        Samples (n_samples, n_channels), masked ones too, or a regular file, whose suffix selects
        the format:

        - ``.wav``: any bit depth. Integers are scaled to [-1, 1).
        - ``.npy``, ``.npz``, ``.mat`` (MATLAB up to version 7.2): unchanged numbers.
        - ``.csv``, ``.txt``: one row per sample, separated by commas, semicolons, tabs or spaces;
          real or complex (``1+2j``, ``1+2i``); a cell that is empty, ``nan``, ``None`` or ``NA`` is
          missing. Comments (``#``, ``%``) and one line of headings may precede it; a first column
          ``time`` or ``t`` is in s.

        In an npz or mat file the array may have the name ``samples`` or ``snapshots`` (complex),
        with a number ``rate``, ``fs`` or ``Fs`` in Hz and an array ``time`` in s.
    rate : float, optional
        Samples per second, Hz; replaces that of the file.
    variable : str, optional
        Name of the array in an npz or mat file, required if there are several.
    transpose : bool
        True if the rows of the file are channels.
    array : SensorArray, optional
        Selects the channels of its sensors, in its order; `array` of the recording.
    max_bytes : float
        Largest size of the stored numbers, decompressed; larger ones are refused unread.
    rate_required : bool
        True to refuse real samples without a rate; arrays with a header are not loaded then.

    Returns
    -------
    Recording
        Real samples (float32 if the file has that precision, else float64), or complex
        snapshots, each (n_samples, n_channels).

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
    if rate is not None:
        positive("rate", rate)
    demands = _Demands(variable, max_bytes, rate_required and rate is None)
    if not isinstance(path, str | PathLike):
        contents = FileContents(numbers("samples", path))
        return _recording(contents, rate, transpose, demands, array)
    path = Path(path)
    with open_input(path) as file:
        try:
            return _recording(_contents(file, path, demands), rate, transpose, demands, array)
        except Exception as error:  # parsers raise all kinds of errors on damaged files
            raise file_error(path, error) from error


class _Demands(NamedTuple):
    """Selected variable, largest size, and whether real samples must have a rate in the file."""

    variable: str | None
    max_bytes: float
    rate_required: bool

    def check(self, n_bytes: int, is_real: bool, has_rate: bool) -> None:
        """Refuse data that are too large or lack a rate."""
        check_size(n_bytes, self.max_bytes)
        if self.rate_required and is_real and not has_rate:
            raise ValueError("the rate is unknown: pass rate= (--rate) in Hz")


def _contents(file: BinaryIO, path: Path, demands: _Demands) -> FileContents:
    suffix = path.suffix.lower()
    if suffix not in READERS:
        raise ValueError(f"suffix must be one of {', '.join(READERS)}; got {suffix!r}")
    if file.seek(0, 2) == 0:
        raise ValueError("the file is empty")
    file.seek(0)
    variable = demands.variable
    if variable is not None and suffix not in (".npz", ".mat"):
        raise ValueError(f"variable must be None except for npz and mat files; got {variable!r}")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return READERS[suffix](file, demands)


def _recording(
    contents: FileContents,
    rate: float | None,
    transpose: bool,
    demands: _Demands,
    array: SensorArray | None,
) -> Recording:
    samples = contents.array[:, None] if contents.array.ndim == 1 else contents.array
    samples = samples.T if transpose else samples
    rate = contents.rate if rate is None else rate
    is_real = samples.dtype.kind != "c"
    if is_real and rate is None and contents.time is not None:
        rate = _rate_of(contents.time)
    demands.check(0, is_real, rate is not None)
    recording = Recording(samples, rate, None if is_real else contents.time)
    return recording if array is None else _with_array(recording, array)


def _with_array(recording: Recording, array: SensorArray) -> Recording:
    samples = array.select(recording.samples)
    return Recording(samples, recording.rate, recording.time, array)


def _rate_of(time: Float) -> float:
    """Return the rate of evenly spaced times, with a tolerance of a tenth of a step."""
    step = float(time[-1] - time[0]) / max(1, len(time) - 1) if np.all(np.isfinite(time)) else 0.0
    if step <= 0 or np.any(np.abs(time - time[0] - step * np.arange(len(time))) > 0.1 * step):
        raise ValueError("the times of the samples are not evenly spaced: pass rate= in Hz")
    return 1 / step


def _numpy(file: BinaryIO, demands: _Demands) -> FileContents:
    return _selected(numpy_arrays(file), demands)


def _matlab(file: BinaryIO, demands: _Demands) -> FileContents:
    return _selected(matlab_arrays(file), demands)


def _selected(stored: Mapping[str, StoredArray], demands: _Demands) -> FileContents:
    """Return the selected array of a file, with its rate and times."""
    name = _choice(stored, demands.variable)
    chosen, time = stored[name], stored.get("time")
    rates = (stored[key] for key in RATES if key in stored)
    one = next((each for each in rates if each.size == 1 and each.is_real), None)
    has_times = time is not None and time.is_numeric and time.size > 1
    if not chosen.is_numeric:
        raise ValueError(f"samples must be numbers; got {chosen.dtype}")
    is_real = chosen.is_real and name != "snapshots"
    demands.check(chosen.n_bytes, is_real, one is not None or has_times)
    array = chosen.load()
    array = array.astype(complex) if name == "snapshots" else array
    times = None
    if time is not None and has_times:
        check_size(time.n_bytes, demands.max_bytes)
        times = np.ravel(time.load())
    return FileContents(array, None if one is None else float(one.load().item()), times)


def _choice(stored: Mapping[str, StoredArray], variable: str | None) -> str:
    names = list(stored)
    if names == [""]:  # of an npy file
        return ""
    if variable is not None:
        if variable not in names:
            raise ValueError(f"variable must be one of {_listed(names)}; got {variable!r}")
        return variable
    arrays = [name for name in names if stored[name].is_numeric and stored[name].size > 1]
    standard = [name for name in arrays if name in ("samples", "snapshots")]
    others = [name for name in arrays if name not in (*RATES, "time")]
    candidates = standard or others
    if len(candidates) != 1:
        number = "several arrays" if candidates else "no array"
        raise ValueError(f"the file has {number}: pass variable=, one of {_listed(names)}")
    return candidates[0]


def _listed(names: Sequence[str]) -> str:
    return ", ".join(map(repr, names)) or "nothing"


def _text(file: BinaryIO, demands: _Demands) -> FileContents:
    check_size(file.seek(0, 2), demands.max_bytes)
    file.seek(0)
    return read_text(file)


READERS: dict[str, Callable[[BinaryIO, _Demands], FileContents]] = {
    ".wav": lambda file, demands: read_wav(file, demands.max_bytes),
    ".npy": _numpy,
    ".npz": _numpy,
    ".mat": _matlab,
    ".csv": _text,
    ".txt": _text,
}
