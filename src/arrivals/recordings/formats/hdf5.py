"""Datasets of HDF5 files, of acoular and MATLAB v7.3 ones too."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from arrivals.recordings.formats.file_contents import (
    RATES,
    FileContents,
    ReadingOptions,
    damage_refused,
    import_reader_package,
)
from arrivals.recordings.stored_samples import StoredSamples, row_type
from arrivals.typing import Float

TIMES = ("time", "t")
STANDARD = ("time_data", "samples", "snapshots")  # names of datasets with samples
CACHE = 2**26  # bytes of the chunks that are kept decompressed
MOST_LISTED, MAX_LINKS = 12, 100_000


class _Dataset(NamedTuple):
    """Dataset of numbers: its shape as MATLAB or NumPy would have it, and its complex fields."""

    name: str
    shape: tuple[int, ...]
    dtype: np.dtype[Any]
    is_matlab: bool

    @property
    def parts(self) -> tuple[str, ...]:
        """Names of real and imaginary part of a compound type."""
        return self.dtype.names or ()

    @property
    def is_complex(self) -> bool:
        return self.dtype.kind == "c" or bool(self.parts)

    @property
    def size(self) -> int:
        return int(np.prod(self.shape, dtype=float))

    def __str__(self) -> str:
        return f"{self.name!r} {' x '.join(map(str, self.shape)) or 'scalar'}"


def is_hdf5(head: bytes) -> bool:
    """Return True for the first bytes of an HDF5 file, or of one of MATLAB v7.3."""
    is_matlab = head[124:128] in (b"\0\2IM", b"\2\0MI")
    return head.startswith(b"\x89HDF\r\n\x1a\n") or is_matlab


def read_hdf5(path: Path, options: ReadingOptions) -> FileContents:
    """Return the samples of an HDF5 file, of which blocks are read on demand.

    Parameters
    ----------
    path : path
        HDF5 file. Rows of a dataset are samples, its columns channels; MATLAB, which stores them
        the other way round, is recognised by its attributes.
    options : ReadingOptions
        `variable` is the path of the dataset, such as ``group/x``; required if there are several
        and none has the name ``time_data``, ``samples`` or ``snapshots``.

    Returns
    -------
    FileContents
        The rate is an attribute of the dataset or of a group above it, or a number beside it, of
        one of the names `RATES`; times are a dataset ``time`` beside it.

    Raises
    ------
    ValueError
        If the file is damaged, or has not one dataset of samples.
    """
    with _opened(path) as file:
        datasets = _datasets(file)
        chosen = _choice(datasets, options.variable)
        if not 1 <= len(chosen.shape) <= 2:
            raise ValueError(f"a dataset must have one or two dimensions; got {chosen}")
        folder = chosen.name.rpartition("/")[0]
        rate = _rate(file, chosen, datasets)
        beside = {_joined(folder, name) for name in TIMES} - {chosen.name}
        time = next((_time(file, datasets[name]) for name in sorted(beside & set(datasets))), None)
    shape = chosen.shape[0], chosen.shape[1] if len(chosen.shape) == 2 else 1
    kind = np.dtype(complex) if chosen.is_complex else row_type(chosen.dtype)
    samples = StoredSamples(shape, kind, partial(_rows, path, chosen))
    return FileContents(samples, rate, time if time is None or len(time) == shape[0] else None)


@contextmanager
def _opened(path: Path) -> Iterator[Any]:
    h5py = import_reader_package("h5py", "an HDF5 file, or MATLAB v7.3,")
    with damage_refused("readable HDF5 file"):
        file = h5py.File(path, "r", rdcc_nbytes=CACHE)
    with file:
        yield file


def _rows(path: Path, dataset: _Dataset, start: int, stop: int) -> NDArray[Any]:
    """Return rows of a dataset, (stop - start, n_channels)."""
    with _opened(path) as file, damage_refused("readable HDF5 file"):
        stored = file[dataset.name]
        is_transposed = dataset.is_matlab and len(dataset.shape) == 2
        block = stored[:, start:stop].T if is_transposed else stored[start:stop]
    if dataset.parts:
        real, imaginary = dataset.parts
        block = block[real] + 1j * block[imaginary]
    return np.asarray(block).reshape(stop - start, -1)


def _datasets(file: Any) -> dict[str, _Dataset]:
    """Return the datasets of numbers, real or complex, by their path."""
    h5py = import_reader_package("h5py", "an HDF5 file")
    found: dict[str, _Dataset] = {}
    with damage_refused("readable HDF5 file"):
        for name, item in _items(h5py, file, "", set()):
            dataset = _of_numbers(name, item)
            if dataset is not None:
                found[name] = dataset
    return found


def _items(h5py: Any, group: Any, path: str, seen: set[Any]) -> Iterator[tuple[str, Any]]:
    """Yield the datasets below a group by their path.

    `visititems` of h5py does not end on some damaged files, the iteration over links does.
    """
    names: dict[bytes, None] = {}

    def is_repeated(name: bytes) -> bool | None:
        known = name in names or len(names) >= MAX_LINKS
        names[name] = None
        return True if known else None

    stopped, _ = group.id.links.iterate(is_repeated)
    if stopped:
        raise ValueError(f"the group {path!r} has a name twice, or more than {MAX_LINKS}")
    for name in (each.decode("utf-8") for each in names):
        is_hard = isinstance(group.get(name, getlink=True), h5py.HardLink)
        item = group[name] if is_hard and not name.startswith("#") else None
        if isinstance(item, h5py.Dataset):
            yield _joined(path, name), item
        elif isinstance(item, h5py.Group) and item.id not in seen:
            yield from _items(h5py, item, _joined(path, name), seen | {item.id})


def _of_numbers(name: str, item: Any) -> _Dataset | None:
    kind, parts = item.dtype, item.dtype.names
    is_pair = parts in (("real", "imag"), ("r", "i")) and all(
        kind[part].kind in "iuf" for part in parts
    )
    is_text = _text(item.attrs.get("MATLAB_class", "")) in ("char", "cell")
    is_number = kind.kind in "iufc" or is_pair
    if item.shape is None or not is_number or is_text or "MATLAB_empty" in item.attrs:
        return None
    is_matlab = "MATLAB_class" in item.attrs
    shape = tuple(int(n) for n in (item.shape[::-1] if is_matlab else item.shape))
    return _Dataset(name, shape, kind, is_matlab)


def _text(value: Any) -> str:
    return value.decode("latin-1") if isinstance(value, bytes) else str(value)


def _choice(datasets: dict[str, _Dataset], variable: str | None) -> _Dataset:
    if variable is not None:
        name = variable.strip("/")
        if name not in datasets:
            got = _listed(datasets.values())
            raise ValueError(f"variable must be one of {got}; got {variable!r}")
        return datasets[name]
    arrays = [
        each
        for name, each in datasets.items()
        if each.size > 1 and name.rpartition("/")[2] not in (*RATES, *TIMES)
    ]
    standard = [each for each in arrays if each.name.rpartition("/")[2] in STANDARD]
    candidates = standard or arrays
    if len(candidates) != 1:
        number = "several datasets" if candidates else "no dataset of numbers"
        cure = f": pass variable= (--variable), one of {_listed(candidates)}" if candidates else ""
        raise ValueError(f"the file has {number}{cure}")
    return candidates[0]


def _listed(datasets: Iterable[_Dataset]) -> str:
    names = [str(each) for each in datasets]
    more = [f"and {len(names) - MOST_LISTED} more"] if len(names) > MOST_LISTED else []
    return ", ".join(names[:MOST_LISTED] + more) or "nothing"


def _rate(file: Any, dataset: _Dataset, datasets: dict[str, _Dataset]) -> float | None:
    """Return the rate of a dataset: of its attributes, the numbers beside it, and those above."""
    places = [dataset.name]
    while places[-1]:
        places.append(places[-1].rpartition("/")[0])
    for place in places:
        for name in RATES:
            attribute = np.asarray((file[place] if place else file).attrs.get(name, ()))
            if attribute.size == 1 and attribute.dtype.kind in "iuf":
                return float(attribute.item())
            scalar = None if place == dataset.name else datasets.get(_joined(place, name))
            if scalar is not None and scalar.size == 1 and not scalar.is_complex:
                return float(np.asarray(file[scalar.name][()]).item())
    return None


def _time(file: Any, dataset: _Dataset) -> Float | None:
    if dataset.size < 2 or dataset.is_complex or dataset.size != max(dataset.shape):
        return None
    with damage_refused("readable HDF5 file"):
        return np.ravel(file[dataset.name][()]).astype(np.float64)


def _joined(folder: str, name: str) -> str:
    return f"{folder}/{name}" if folder else name
