"""Files of recordings: WAV, NumPy, MATLAB and text."""

from __future__ import annotations

import io
import re
import struct
import warnings
from collections.abc import Callable, Iterator, Sequence
from os import PathLike
from pathlib import Path
from typing import Any, BinaryIO, NamedTuple

import numpy as np
from numpy.typing import NDArray

from arrivals.measurement_models import SensorArray
from arrivals.recordings.recording import Recording
from arrivals.typing import Float
from arrivals.validation import positive

RATES = ("rate", "fs", "Fs")  # names of a scalar that tells the rate
TIMES = ("time", "time_s", "t")  # headings of a first column that tells the time
# The sizes that ffmpeg, sox and arecord write into a header that they cannot come back to.
STREAMED = (0, 0x7FFFF000, 0x7FFFFFFF, 0x80000000, 0xFFFFFFFF)


class Contents(NamedTuple):
    """What a file holds: the array as it is stored, and what is known of its rate and times."""

    array: NDArray[Any]
    rate: float | None = None
    time: Float | None = None


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
    path : path
        The suffix tells the format:

        - ``.wav``: any bit depth. Integers are scaled to [-1, 1).
        - ``.npy``, ``.npz``, ``.mat`` (MATLAB up to version 7.2): numbers as they are.
        - ``.csv``, ``.txt``: one row per sample, separated by commas, semicolons, tabs or spaces;
          real or complex (``1+2j``, ``1+2i``); an empty cell is NaN. Before it may stand comments
          (``#``, ``%``) and one line of headings; a first column headed ``time`` or ``t`` is in s.

        In an npz or mat file the array may be called ``samples`` or ``snapshots`` (those are
        complex), beside it a number ``rate``, ``fs`` or ``Fs`` in Hz and an array ``time`` in s.
    rate : float, optional
        Samples per second, Hz; goes before what the file says.
    variable : str, optional
        Name of the array in an npz or mat file, needed if there is more than one.
    transpose : bool
        Whether the rows of the file are the channels.
    array : SensorArray, optional
        Takes the channels of its sensors, in its order, and goes with the recording.

    Returns
    -------
    Recording
        Real samples (float32 where the file holds no more than that, else float64), or complex
        snapshots, each (n_samples, n_channels).

    Raises
    ------
    OSError
        If there is no such file, or it may not be read.
    ValueError
        If the file is empty, truncated, of an unknown format, or does not hold one array of
        numbers of one or two dimensions. The message is one line that begins with the path.

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
            return recording if array is None else _of_array(recording, array)
        except Exception as error:  # the parsers fail on a damaged file in every way there is
            raise ValueError(f"{path}: {' '.join(str(error).split())}") from error


def _contents(file: BinaryIO, path: Path, variable: str | None) -> Contents:
    suffix = path.suffix.lower()
    if suffix not in READERS:
        raise ValueError(f"the suffix must be one of {', '.join(READERS)}; got {suffix!r}")
    if path.stat().st_size == 0:
        raise ValueError("the file is empty")
    if variable is not None and suffix not in (".npz", ".mat"):
        raise ValueError(f"variable is for npz and mat files; got {variable!r}")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return READERS[suffix](file, variable)


def _recording(contents: Contents, rate: float | None, transpose: bool) -> Recording:
    array = contents.array[:, None] if contents.array.ndim == 1 else contents.array
    array = array.T if transpose else array
    rate = contents.rate if rate is None else rate
    if array.dtype.kind == "c":
        return Recording(array, rate, contents.time)
    if rate is None and contents.time is not None:
        rate = _rate_of(contents.time)
    return Recording(array, rate)


def _of_array(recording: Recording, array: SensorArray) -> Recording:
    samples = array.select(recording.samples)
    return Recording(samples, recording.rate, recording.time, array)


def _rate_of(time: Float) -> float:
    """Return the rate of times that are evenly spaced, to a tenth of a step."""
    step = float(time[-1] - time[0]) / max(1, len(time) - 1) if np.all(np.isfinite(time)) else 0.0
    if step <= 0 or np.any(np.abs(time - time[0] - step * np.arange(len(time))) > 0.1 * step):
        raise ValueError("the times of the samples are not evenly spaced: pass rate= in Hz")
    return 1 / step


def _wav(file: BinaryIO, variable: str | None) -> Contents:
    from scipy.io import wavfile

    start, promised, frame, streamed = _wav_header(file)
    held = file.seek(0, io.SEEK_END) - start
    if streamed:
        file = _mended(file, start, held // frame * frame)
    elif promised > held:
        raise ValueError(f"truncated: {promised} bytes of samples are announced, {held} are there")
    file.seek(0)
    rate, samples = wavfile.read(file)
    return Contents(_scaled(samples), positive("rate", rate))


def _wav_header(file: BinaryIO) -> tuple[int, int, int, bool]:
    """Return where samples begin, bytes announced, bytes a frame, and whether it was streamed."""
    kind, riff_size, form = struct.unpack("4s4s4s", file.read(12).ljust(12))
    if kind not in (b"RIFF", b"RIFX", b"RF64") or form != b"WAVE":
        raise ValueError("this is not a WAV file")
    order: Any = "big" if kind == b"RIFX" else "little"
    frame = long_size = 0
    while len(head := file.read(8)) == 8:
        name, size, start = head[:4], int.from_bytes(head[4:], order), file.tell()
        if name == b"data":
            consistent = int.from_bytes(riff_size, order) + 8 == file.seek(0, io.SEEK_END)
            streamed = size in STREAMED and not consistent and not long_size
            return start, long_size or size, max(frame, 1), streamed
        body = file.read(16)
        if name == b"fmt ":
            frame = int.from_bytes(body[12:14], order)
        elif name == b"ds64":
            long_size = int.from_bytes(body[8:16], order)
        file.seek(start + size + size % 2)
    raise ValueError("truncated: the header announces no samples")


def _mended(file: BinaryIO, start: int, size: int) -> BinaryIO:
    """Return a streamed file with the sizes in its header put right."""
    file.seek(0)
    raw = bytearray(file.read(start + size))
    order: Any = "big" if raw[:4] == b"RIFX" else "little"
    raw[4:8] = (start + size - 8).to_bytes(4, order)
    raw[start - 4 : start] = size.to_bytes(4, order)
    return io.BytesIO(raw)


def _scaled(samples: NDArray[Any]) -> NDArray[Any]:
    """Return integers as numbers in [-1, 1), exactly; 8 bits are offset, more are signed."""
    if samples.dtype.kind == "f":
        return samples
    if samples.dtype.kind == "u":
        return np.asarray((samples - np.float32(128)) / np.float32(128))
    kind: Any = np.float32 if samples.dtype.itemsize <= 2 else np.float64
    return np.asarray(samples.astype(kind) * kind(2.0 ** (1 - 8 * samples.dtype.itemsize)))


def _numpy(file: BinaryIO, variable: str | None) -> Contents:
    try:
        loaded = np.load(file, allow_pickle=False)
        if isinstance(loaded, np.ndarray):
            return Contents(loaded)
        with loaded:
            return _named(loaded.files, loaded.files, loaded.__getitem__, variable)
    except _ChoiceError:
        raise
    except Exception as error:
        raise ValueError(f"truncated, or no file of numbers by NumPy: {error}") from error


def _matlab(file: BinaryIO, variable: str | None) -> Contents:
    from scipy.io import loadmat

    try:
        loaded = loadmat(file)
    except NotImplementedError:
        raise ValueError(
            "MATLAB v7.3 (HDF5) would need h5py, which is not supported: save it with -v7"
        ) from None
    except Exception as error:
        raise ValueError(f"truncated, or no MATLAB file: {error}") from error
    names = [name for name in loaded if not name.startswith("__")]
    arrays = [name for name in names if _is_table(loaded[name])]
    return _named(names, arrays, loaded.__getitem__, variable)


def _is_table(value: Any) -> bool:
    return isinstance(value, np.ndarray) and value.dtype.kind in "iufc" and value.size > 1


class _ChoiceError(ValueError):
    """Which array is wanted is not clear."""


def _named(
    names: list[str], arrays: list[str], load: Callable[[str], Any], variable: str | None
) -> Contents:
    """Return the array that is wanted out of several names, with its rate and times."""
    name = _choice(names, arrays, variable)
    array = np.asarray(load(name))
    rates = (np.asarray(load(rate)) for rate in RATES if rate in names)
    rate = next((float(r.item()) for r in rates if r.size == 1 and r.dtype.kind in "iuf"), None)
    time: Any = load("time") if "time" in names else None
    snapshots = name == "snapshots" and array.dtype.kind in "iuf"
    array = array.astype(complex) if snapshots else array
    return Contents(array, rate, np.ravel(time) if _is_table(time) else None)


def _choice(names: list[str], arrays: list[str], variable: str | None) -> str:
    if variable is not None:
        if variable not in names:
            raise _ChoiceError(f"there is no variable {variable!r}; there is: {_listed(names)}")
        return variable
    ours = [name for name in arrays if name in ("samples", "snapshots")]
    others = [name for name in arrays if name not in (*RATES, "time")]
    found = ours or others
    if len(found) != 1:
        wanted = "several arrays" if found else "no array"
        raise _ChoiceError(f"the file holds {wanted}, pass variable=; there is: {_listed(names)}")
    return found[0]


def _listed(names: Sequence[str]) -> str:
    return ", ".join(map(repr, names)) or "nothing"


def _text(file: BinaryIO, variable: str | None) -> Contents:
    rows: list[NDArray[Any]] = []
    heading: list[str] | None = None
    for line, cells in _lines(io.TextIOWrapper(file, encoding="utf-8-sig")):
        if not rows and heading is None and not any(map(_is_number, cells)):
            heading = cells
            continue
        if rows and len(cells) != len(rows[0]):
            raise ValueError(f"line {line} has {len(cells)} values, those before {len(rows[0])}")
        rows.append(np.array([_cell(cell, line) for cell in cells]))
    if not rows:
        raise ValueError("the file holds no numbers")
    table = np.array(rows)
    if heading and heading[0].strip().lower() in TIMES and table.shape[1] > 1:
        return Contents(table[:, 1:], time=table[:, 0].real)
    return Contents(table)


def _lines(file: io.TextIOWrapper) -> Iterator[tuple[int, list[str]]]:
    """Yield the number and the cells of each line that is not blank or a comment."""
    separator: str | None = ""
    for number, line in enumerate(file, 1):
        line = line.strip(" \r\n")
        if not line or line[0] in "#%":
            continue
        if separator == "":
            separator = next((s for s in ";,\t" if s in line), None)
        line = line.replace(",", ".") if separator == ";" else line  # a decimal comma
        yield number, line.split(separator)


def _is_number(cell: str) -> bool:
    try:
        return bool(cell.strip()) and _cell(cell, 1) is not None
    except ValueError:
        return False


def _cell(cell: str, line: int) -> float | complex:
    """Return the number in a cell, NaN if it is empty."""
    text = cell.strip()
    try:
        return float(text or "nan")
    except ValueError:
        pass
    try:
        return complex(re.sub(r"i(?=\)?$)", "j", text.replace(" ", "")).replace("+-", "-"))
    except ValueError:
        raise ValueError(f"line {line} holds {text!r}, which is not a number") from None


READERS: dict[str, Callable[[BinaryIO, str | None], Contents]] = {
    ".wav": _wav,
    ".npy": _numpy,
    ".npz": _numpy,
    ".mat": _matlab,
    ".csv": _text,
    ".txt": _text,
}
