"""SigMF recordings: metadata and samples side by side, or in one archive."""

from __future__ import annotations

import json
import re
import tarfile
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
from arrivals.recordings.raw_numbers import RawRows, real_type, scale_of
from arrivals.recordings.stored_samples import StoredSamples
from arrivals.validation import count, positive

DATATYPE = re.compile(r"[cr](f32|f64|i32|i16)_[lb]e|[cr][iu]8")
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
    locate = _in_archive if path.suffix.lower() == ARCHIVE else _beside
    with damage_refused("SigMF recording"):
        metadata, data, offset, n_bytes = locate(path)
        recording = sigmf.SigMFFile(metadata=json.loads(metadata))
        n_channels, frame = _checked(recording, n_bytes)
    fields, captures = recording.get_global_info(), recording.get_captures()
    parts, name = fields["core:datatype"][0], fields["core:datatype"][1:]
    is_complex, kind = parts == "c", _number(name)
    zero = 128 if kind == "|u1" else 0
    rows = RawRows(data, offset, kind, (1 + is_complex) * n_channels, zero)
    dtype = np.dtype(complex) if is_complex else real_type(kind)
    load = partial(_rows, rows, is_complex)
    samples = StoredSamples((n_bytes // frame, n_channels), dtype, load)
    rate = fields.get("core:sample_rate")
    rate = None if rate is None else positive("core:sample_rate", rate)
    frequency, note = _frequency(captures), _note(captures, recording.get_annotations())
    return FileContents(samples, rate, frequency=frequency, note=note)


def _rows(rows: RawRows, is_complex: bool, start: int, stop: int) -> NDArray[Any]:
    """Return rows of all channels, (stop - start, n_channels); integers in [-1, 1)."""
    numbers = np.ascontiguousarray(rows(start, stop), real_type(rows.kind))
    scale = scale_of(rows.kind)
    numbers = numbers if scale is None else np.multiply(numbers, scale, dtype=numbers.dtype)
    return numbers.view(np.result_type(numbers, np.complex64)) if is_complex else numbers


def _number(name: str) -> str:
    """Return the type code of numpy of f32_le, i16_be, u8 and so on."""
    size = int(name[1:].partition("_")[0]) // 8
    return f"{'|' if size == 1 else '>' if name.endswith('_be') else '<'}{name[0]}{size}"


def _in_archive(path: Path) -> tuple[bytes, Path, int, int]:
    """Return metadata, and the file, the first byte and the number of bytes of the samples."""
    with tarfile.open(path, "r:") as archive:
        members = [each for each in archive.getmembers() if each.isfile()]
        meta = [each for each in members if each.name.endswith(META)]
        data = [each for each in members if each.name.endswith(DATA)]
        if len(meta) != 1 or len(data) != 1:
            raise ValueError(f"an archive must have one recording; got {len(meta)}")
        file = archive.extractfile(meta[0])
        metadata = b"" if file is None or meta[0].size > MAX_META else file.read()
    return metadata, path, data[0].offset_data, data[0].size


def _beside(path: Path) -> tuple[bytes, Path, int, int]:
    """Return metadata and samples of two files of the same name, as `_in_archive` does."""
    meta, data = path.with_suffix(META), path.with_suffix(DATA)
    if not meta.is_file():
        cure = "or read raw samples by --format and --rate"
        raise ValueError(f"{meta.name} is missing: put it beside the samples, {cure}")
    if not data.is_file():
        raise ValueError(f"{data.name} is missing: put it beside the metadata")
    if meta.stat().st_size > MAX_META:
        raise ValueError(f"the metadata must have at most {MAX_META} bytes")
    return meta.read_bytes(), data, 0, data.stat().st_size


def _checked(recording: Any, n_bytes: int) -> tuple[int, int]:
    """Return number of channels and bytes of a sample; the fields must fit the number of bytes."""
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
    least = max([1, *ends])
    if n_bytes % frame or n_bytes // frame < least:
        raise ValueError(
            f"expected at least {least} samples of {n_channels} channels, {datatype} ({frame} "
            f"bytes); got {n_bytes / frame:.8g}: copy the samples again"
        )
    return n_channels, frame


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
