"""Seismic traces in miniSEED files, aligned in time."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from arrivals.recordings.formats.file_contents import (
    FileContents,
    ReadingOptions,
    damage_refused,
    import_reader_package,
)
from arrivals.recordings.stored_samples import StoredSamples
from arrivals.typing import Float, Int

MAX_GAPS, LEAST_SPAN = 1000, 2**24  # span over samples of a trace, above so many samples
SECOND = (b"D ", b"R ", b"Q ", b"M ", b"D\0", b"R\0", b"Q\0", b"M\0")  # after the number, version 2
LARGEST_OFFSET = 0.1  # of a sample, between clocks, without a note


class _Record(NamedTuple):
    """Where a record is in the file, its channel, time (ns), rate (Hz) and number of samples."""

    offset: int
    size: int
    name: str
    start: int
    rate: float
    n_samples: int


@dataclass(frozen=True, eq=False)
class _Traces:
    """Records of the selected channels on a common grid of time."""

    path: Path
    offset: Int
    size: Int
    channel: Int
    first: Int  # sample of the grid
    n_samples: Int
    n_channels: int

    def rows(self, start: int, stop: int) -> Float:
        """Return samples (stop - start, n_channels), NaN in gaps."""
        pymseed = import_reader_package("pymseed", "a miniSEED file")
        block = np.full((max(0, stop - start), self.n_channels), np.nan)
        inside = np.flatnonzero((self.first < stop) & (self.first + self.n_samples > start))
        with self.path.open("rb") as file, damage_refused("miniSEED file"):
            for i in inside.tolist():
                file.seek(int(self.offset[i]))
                data = file.read(int(self.size[i]))
                record = next(iter(pymseed.MS3Record.from_buffer(data, unpack_data=True)))
                values: NDArray[Any] = np.array(record.np_datasamples)
                first = int(self.first[i])
                low, high = max(start, first), min(stop, first + len(values))
                block[low - start : high - start, self.channel[i]] = values[
                    low - first : high - first
                ]
        return block


def is_miniseed(head: bytes) -> bool:
    """Return True for the first bytes of a miniSEED file of version 2 or 3."""
    is_numbered = head[:6].replace(b" ", b"0").isdigit()
    return head.startswith(b"MS\x03") or (is_numbered and head[6:8] in SECOND)


def read_miniseed(path: Path, options: ReadingOptions) -> FileContents:
    """Return the traces of a miniSEED file on a common grid of time, read on demand.

    Parameters
    ----------
    path : path
        miniSEED file of version 2 or 3.
    options : ReadingOptions
        `variable` is the component, such as ``SHZ`` or, with its location, ``00.SHZ``; required if
        there are several.

    Returns
    -------
    FileContents
        Channels in order of their names NET.STA.LOC.CHA. Samples before, after and between the
        records of a trace are NaN. Traces whose samples lie between those of the grid, of the
        earliest trace, are shifted to the nearest, by at most half a sample.

    Raises
    ------
    ValueError
        If the file is damaged, or its rates or components differ.
    """
    pymseed = import_reader_package("pymseed", "a miniSEED file")
    with damage_refused("miniSEED file"):
        records = _records(pymseed, path)
    if not records:
        raise ValueError("the file has no samples")
    names = _chosen(list({each.name for each in records}), options.variable)
    records = [each for each in records if each.name in names]
    rates = sorted({each.rate for each in records})
    if rates[-1] > rates[0] * (1 + 1e-4):
        shown = ", ".join(f"{each:g}" for each in rates)
        raise ValueError(f"the traces have several rates, {shown} Hz: resample them to one")
    traces, n_samples, offset = _aligned(path, records, names, rates[0])
    samples = StoredSamples((n_samples, len(names)), np.dtype(float), traces.rows)
    note = None if offset <= LARGEST_OFFSET else (
        f"clocks differ by up to {offset:.2f} of a sample, {1e3 * offset / rates[0]:.3g} ms"
    )  # fmt: skip
    return FileContents(samples, rates[0], names=tuple(names), note=note)


def _records(pymseed: Any, path: Path) -> list[_Record]:
    """Return the records of a file that contain numbers."""
    records, offset = [], 0
    labels: dict[str, str] = {}
    for each in pymseed.MS3Record.from_file(path):
        source = each.sourceid
        if source not in labels:
            labels[source] = ".".join(pymseed.sourceid2nslc(source))
        if each.samplecnt > 0 and each.samprate > 0:
            records.append(_Record(offset, each.reclen, labels[source], each.starttime,
                                   each.samprate, each.samplecnt))  # fmt: skip
        offset += each.reclen
    return records


def _aligned(
    path: Path, records: Sequence[_Record], names: Sequence[str], rate: float
) -> tuple[_Traces, int, float]:
    """Return records on the grid of the earliest, its length, and the largest offset in samples."""
    number = {name: i for i, name in enumerate(names)}
    channel = np.array([number[each.name] for each in records])
    start = np.array([each.start for each in records])
    exact = (start - start.min()) * (rate * 1e-9)
    origin = np.array([exact[channel == i].min() for i in range(len(names))])[channel]
    first = (np.round(origin) + np.round(exact - origin)).astype(np.int64)
    n_samples = np.array([each.n_samples for each in records])
    length = int((first + n_samples).max())
    n_present = int(n_samples.sum()) // len(names)
    if length > max(LEAST_SPAN, MAX_GAPS * n_present):
        raise ValueError(
            f"the records are too far apart: {n_present} samples a trace in {length / rate:.4g} s"
        )
    place, size = np.array([(each.offset, each.size) for each in records]).T
    traces = _Traces(path, place, size, channel, first, n_samples, len(names))
    return traces, length, float(np.abs(exact - first).max())


def _chosen(names: Sequence[str], variable: str | None) -> list[str]:
    """Return the names NET.STA.LOC.CHA of one component, one a station, in order."""
    parts = {name: name.split(".") for name in sorted(names)}
    codes = sorted({f"{each[2]}.{each[3]}".strip(".") for each in parts.values()})
    channels = sorted({each[3] for each in parts.values()})
    if variable is None and len(channels) > 1:
        raise ValueError(
            "the traces have several components: pass variable= (--variable), one of "
            f"{', '.join(channels)}"
        )
    wanted = channels[0] if variable is None else variable
    chosen = [name for name, each in parts.items() if wanted in (each[3], f"{each[2]}.{each[3]}")]
    if not chosen:
        raise ValueError(f"variable must be one of {', '.join(codes)}; got {variable!r}")
    stations = [name.rsplit(".", 2)[0] for name in chosen]
    if len(set(stations)) < len(stations):
        raise ValueError(
            "a station has several traces: pass variable= (--variable), one of "
            f"{', '.join(each for each in codes if each.endswith(wanted))}"
        )
    return chosen
