"""Readers of recording files: WAV, NumPy, MATLAB and text."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Sequence
from os import PathLike
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np

from arrivals.measurement_models import SensorArray
from arrivals.recordings.file_contents import FileContents
from arrivals.recordings.recording import Recording
from arrivals.recordings.text_table import read_text
from arrivals.recordings.wav import read_wav
from arrivals.typing import Float
from arrivals.validation import positive

RATES = ("rate", "fs", "Fs")  # names of a scalar with the rate


def read(
    path: str | PathLike[str],
    *,
    rate: float | None = None,
    variable: str | None = None,
    transpose: bool = False,
    array: SensorArray | None = None,
) -> Recording:
    """Read a recording from a file.

    Parameters
    ----------
    path : str or path
        The suffix selects the format:

        - ``.wav``: any bit depth. Integers are scaled to [-1, 1).
        - ``.npy``, ``.npz``, ``.mat`` (MATLAB up to version 7.2): unchanged numbers.
        - ``.csv``, ``.txt``: one row per sample, separated by commas, semicolons, tabs or spaces;
          real or complex (``1+2j``, ``1+2i``); an empty cell is NaN. Comments (``#``, ``%``)
          and one line of headings may precede it; a first column ``time`` or ``t`` is in s.

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

    Returns
    -------
    Recording
        Real samples (float32 if the file has that precision, else float64), or complex
        snapshots, each (n_samples, n_channels).

    Raises
    ------
    OSError
        If the file does not exist or cannot be read.
    ValueError
        If the file is empty, truncated, of an unknown format, or does not contain one array
        of numbers of one or two dimensions. The message is one line that begins with the path.

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
    path = Path(path)
    if rate is not None:
        positive("rate", rate)
    with path.open("rb") as file:
        try:
            recording = _recording(_contents(file, path, variable), rate, transpose)
            return recording if array is None else _with_array(recording, array)
        except Exception as error:  # parsers raise all kinds of errors on damaged files
            raise ValueError(f"{path}: {' '.join(str(error).split())}") from error


def _contents(file: BinaryIO, path: Path, variable: str | None) -> FileContents:
    suffix = path.suffix.lower()
    if suffix not in READERS:
        raise ValueError(f"suffix must be one of {', '.join(READERS)}; got {suffix!r}")
    if path.stat().st_size == 0:
        raise ValueError("the file is empty")
    if variable is not None and suffix not in (".npz", ".mat"):
        raise ValueError(f"variable must be None except for npz and mat files; got {variable!r}")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return READERS[suffix](file, variable)


def _recording(contents: FileContents, rate: float | None, transpose: bool) -> Recording:
    array = contents.array[:, None] if contents.array.ndim == 1 else contents.array
    array = array.T if transpose else array
    rate = contents.rate if rate is None else rate
    if array.dtype.kind == "c":
        return Recording(array, rate, contents.time)
    if rate is None and contents.time is not None:
        rate = _rate_of(contents.time)
    return Recording(array, rate)


def _with_array(recording: Recording, array: SensorArray) -> Recording:
    samples = array.select(recording.samples)
    return Recording(samples, recording.rate, recording.time, array)


def _rate_of(time: Float) -> float:
    """Return the rate of evenly spaced times, with a tolerance of a tenth of a step."""
    step = float(time[-1] - time[0]) / max(1, len(time) - 1) if np.all(np.isfinite(time)) else 0.0
    if step <= 0 or np.any(np.abs(time - time[0] - step * np.arange(len(time))) > 0.1 * step):
        raise ValueError("the times of the samples are not evenly spaced: pass rate= in Hz")
    return 1 / step


def _numpy(file: BinaryIO, variable: str | None) -> FileContents:
    try:
        stored = np.load(file, allow_pickle=False)
        if isinstance(stored, np.ndarray):
            return FileContents(stored)
        with stored:
            return _select(stored.files, stored.files, stored.__getitem__, variable)
    except _ChoiceError:
        raise
    except Exception as error:
        raise ValueError(f"truncated, or not a NumPy file of numbers: {error}") from error


def _matlab(file: BinaryIO, variable: str | None) -> FileContents:
    from scipy.io import loadmat

    try:
        stored = loadmat(file)
    except NotImplementedError:
        raise ValueError(
            "MATLAB v7.3 (HDF5) requires h5py, which is not supported: save it with -v7"
        ) from None
    except Exception as error:
        raise ValueError(f"truncated, or not a MATLAB file: {error}") from error
    names = [name for name in stored if not name.startswith("__")]
    arrays = [name for name in names if _is_table(stored[name])]
    return _select(names, arrays, stored.__getitem__, variable)


def _is_table(value: Any) -> bool:
    return isinstance(value, np.ndarray) and value.dtype.kind in "iufc" and value.size > 1


class _ChoiceError(ValueError):
    """The selection of an array is missing or ambiguous."""


def _select(
    names: list[str], arrays: list[str], load: Callable[[str], Any], variable: str | None
) -> FileContents:
    """Return the selected array of several names, with its rate and times."""
    name = _choice(names, arrays, variable)
    array = np.asarray(load(name))
    rates = (np.asarray(load(rate)) for rate in RATES if rate in names)
    rate = next((float(r.item()) for r in rates if r.size == 1 and r.dtype.kind in "iuf"), None)
    time: Any = load("time") if "time" in names else None
    snapshots = name == "snapshots" and array.dtype.kind in "iuf"
    array = array.astype(complex) if snapshots else array
    return FileContents(array, rate, np.ravel(time) if _is_table(time) else None)


def _choice(names: list[str], arrays: list[str], variable: str | None) -> str:
    if variable is not None:
        if variable not in names:
            raise _ChoiceError(f"variable must be one of {_listed(names)}; got {variable!r}")
        return variable
    standard = [name for name in arrays if name in ("samples", "snapshots")]
    others = [name for name in arrays if name not in (*RATES, "time")]
    candidates = standard or others
    if len(candidates) != 1:
        number = "several arrays" if candidates else "no array"
        raise _ChoiceError(f"the file has {number}: pass variable=, one of {_listed(names)}")
    return candidates[0]


def _listed(names: Sequence[str]) -> str:
    return ", ".join(map(repr, names)) or "nothing"


READERS: dict[str, Callable[[BinaryIO, str | None], FileContents]] = {
    ".wav": lambda file, variable: read_wav(file),
    ".npy": _numpy,
    ".npz": _numpy,
    ".mat": _matlab,
    ".csv": lambda file, variable: read_text(file),
    ".txt": lambda file, variable: read_text(file),
}
