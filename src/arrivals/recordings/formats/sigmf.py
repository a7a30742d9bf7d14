"""SigMF recordings: metadata and samples side by side, or in one archive."""

from __future__ import annotations

import json
import re
from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from arrivals.recordings.formats.file_contents import (
    FileContents,
    ReadingOptions,
    damage_refused,
    import_reader_package,
)
from arrivals.recordings.stored_samples import StoredSamples
from arrivals.validation import count, positive

DATATYPE = re.compile(r"[cr](f32|f64|[iu]32|[iu]16)_[lb]e|[cr][iu]8")
META, DATA, ARCHIVE = ".sigmf-meta", ".sigmf-data", ".sigmf"
MAX_META = 100_000_000  # bytes of the metadata


def read_sigmf(path: Path, options: ReadingOptions) -> FileContents:
    """Return the samples of a SigMF recording, of which blocks are read on demand.

    Parameters
    ----------
    path : path
        Metadata, or samples (the other one is beside it), or an archive that is not compressed.
    options : ReadingOptions
        None concerns the format.

    Returns
    -------
    FileContents
        Rate and centre frequency are those of the metadata. All captures are read as one recording;
        their frequencies must be equal. Annotations are ignored.

    Raises
    ------
    ValueError
        If metadata or samples are missing, damaged, or do not fit each other.
    """
    sigmf = import_reader_package("sigmf", "a SigMF recording")
    read_from = _in_archive if path.suffix.lower() == ARCHIVE else _beside
    with damage_refused("SigMF recording"):
        recording = read_from(sigmf, path)
    fields, captures = recording.get_global_info(), recording.get_captures()
    n_channels = int(fields.get("core:num_channels", 1))
    rate = fields.get("core:sample_rate")
    kind = np.dtype(complex if fields["core:datatype"][0] == "c" else np.float32)
    load = partial(_rows, recording, n_channels)
    samples = StoredSamples((recording.sample_count, n_channels), kind, load)
    rate = None if rate is None else positive("core:sample_rate", rate)
    frequency, note = _frequency(captures), _note(captures, recording.get_annotations())
    return FileContents(samples, rate, frequency=frequency, note=note)


def _rows(recording: Any, n_channels: int, start: int, stop: int) -> NDArray[Any]:
    """Return rows of all channels, (stop - start, n_channels); integers in [-1, 1)."""
    if stop <= start:
        return np.zeros((0, n_channels))
    block: NDArray[Any] = recording.read_samples(start, stop - start)
    return block.reshape(-1, n_channels)


def _in_archive(sigmf: Any, path: Path) -> Any:
    recording = sigmf.fromarchive(path, skip_checksum=True)
    _check(recording, recording.data_size_bytes)
    return recording


def _beside(sigmf: Any, path: Path) -> Any:
    """Return metadata, with the samples in the file of the same name."""
    meta, data = path.with_suffix(META), path.with_suffix(DATA)
    if not meta.is_file():
        cure = "or read raw samples by --format and --rate"
        raise ValueError(f"{meta.name} is missing: put it beside the samples, {cure}")
    if not data.is_file():
        raise ValueError(f"{data.name} is missing: put it beside the metadata")
    if meta.stat().st_size > MAX_META:
        raise ValueError(f"the metadata must have at most {MAX_META} bytes")
    recording = sigmf.SigMFFile(metadata=json.loads(meta.read_text("utf-8-sig")))
    _check(recording, data.stat().st_size)
    recording.set_data_file(data, skip_checksum=True)
    return recording


def _check(recording: Any, n_bytes: int) -> None:
    """Raise a ValueError if the fields are invalid, or do not fit the number of bytes."""
    fields, captures = recording.get_global_info(), recording.get_captures()
    datatype = fields.get("core:datatype")
    if not (isinstance(datatype, str) and DATATYPE.fullmatch(datatype)):
        raise ValueError(f"core:datatype must be such as 'cf32_le' or 'ci16_le'; got {datatype!r}")
    n_channels = count("core:num_channels", fields.get("core:num_channels", 1))
    if any(each.get("core:header_bytes") for each in [*captures, fields]):
        raise ValueError("core:header_bytes must be 0: the samples must have no other header")
    frame = recording.get_sample_size() * n_channels
    parts = [*captures, *recording.get_annotations()]
    ends = (each.get("core:sample_start", 0) + each.get("core:sample_count", 0) for each in parts)
    least = max(1, *ends, 1)
    if n_bytes % frame or n_bytes // frame < least:
        raise ValueError(
            f"expected at least {least} samples of {n_channels} channels, {datatype} ({frame} "
            f"bytes); got {n_bytes / frame:.8g}: copy the samples again"
        )


def _frequency(captures: Sequence[Mapping[str, Any]]) -> float | None:
    """Return the centre frequency, Hz, of all captures; None if unknown, or if they differ."""
    values = {each.get("core:frequency") for each in captures} - {None}
    return positive("core:frequency", values.pop()) if len(values) == 1 else None


def _note(captures: Sequence[Mapping[str, Any]], annotations: Sequence[Any]) -> str | None:
    """Return how several captures, and annotations, are read; None if there are none."""
    frequencies = sorted({each.get("core:frequency", 0) for each in captures} - {0})
    parts = []
    if len(captures) > 1:
        parts.append(f"{len(captures)} captures are read as one, without gaps")
    if len(frequencies) > 1:
        shown = ", ".join(f"{each:.9g}" for each in frequencies)
        parts.append(f"their frequencies, {shown} Hz, differ: pass --center")
    if annotations:
        noun = "annotation is" if len(annotations) == 1 else "annotations are"
        parts.append(f"{len(annotations)} {noun} ignored")
    return "; ".join(parts) or None
