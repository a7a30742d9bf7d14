"""Readers of recording files by suffix and content, those of other packages included."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path

from arrivals.recordings.formats.audio import (
    is_aiff,
    is_caf,
    is_flac,
    is_ogg,
    is_w64,
    read_audio,
)
from arrivals.recordings.formats.file_contents import FileContents, ReadingOptions
from arrivals.recordings.formats.hdf5 import is_hdf5, read_hdf5
from arrivals.recordings.formats.iq import SUFFIXES, read_iq
from arrivals.recordings.formats.matlab import is_matlab, read_matlab
from arrivals.recordings.formats.miniseed import is_miniseed, read_miniseed
from arrivals.recordings.formats.numpy_files import is_numpy, read_numpy
from arrivals.recordings.formats.sigmf import read_sigmf
from arrivals.recordings.formats.sio import is_sio, read_sio
from arrivals.recordings.formats.text_table import read_text
from arrivals.recordings.formats.wav import is_wav, read_wav
from arrivals.registry import installed, loaded

GROUP = "arrivals.readers"  # of the entry points of other packages
HEAD = 512  # bytes of a file by which its format is recognised


@dataclass(frozen=True)
class Reader:
    """Reader of a format of recording files.

    Parameters
    ----------
    name : str
        Name of the format in messages, such as FLAC.
    suffixes : tuple of str
        In lower case, with the dot.
    read : callable
        `read(path, options)` returns the contents of a regular file that is not empty. Its errors
        need not contain the path.
    recognises : callable, optional
        Returns True if the first bytes of a file, at most 512, are those of the format; None for a
        format without a header.
    has_names : bool
        True if a file may have several arrays, of which `variable` selects one.

    Examples
    --------
    >>> reader = Reader("example", (".ex",), lambda path, options: None, lambda head: head == b"ex")
    >>> reader.takes(b"ex"), reader.takes(b"RIFF")
    (True, False)
    """

    name: str
    suffixes: tuple[str, ...]
    read: Callable[[Path, ReadingOptions], FileContents]
    recognises: Callable[[bytes], bool] | None = None
    has_names: bool = False

    def takes(self, head: bytes) -> bool:
        """Return True if the first bytes of a file are those of the format."""
        return self.recognises is not None and self.recognises(head)


READERS = (
    Reader("WAV", (".wav", ".wave", ".bwf", ".rf64"), read_wav, is_wav),
    Reader("FLAC", (".flac",), read_audio, is_flac),
    Reader("OGG", (".ogg", ".oga", ".opus"), read_audio, is_ogg),
    Reader("AIFF", (".aif", ".aiff", ".aifc"), read_audio, is_aiff),
    Reader("CAF", (".caf",), read_audio, is_caf),
    Reader("W64", (".w64",), read_audio, is_w64),
    Reader("NumPy", (".npy", ".npz"), read_numpy, is_numpy, has_names=True),
    Reader("MATLAB", (".mat",), read_matlab, is_matlab, has_names=True),
    Reader("HDF5", (".h5", ".hdf5", ".he5", ".hdf", ".mat"), read_hdf5, is_hdf5, has_names=True),
    Reader("SigMF", (".sigmf-meta", ".sigmf-data", ".sigmf"), read_sigmf),
    Reader("SIO", (".sio",), read_sio, is_sio),
    Reader(
        "miniSEED",
        (".mseed", ".miniseed", ".ms", ".msd", ".seed"),
        read_miniseed,
        is_miniseed,
        has_names=True,
    ),
    Reader("IQ", tuple(SUFFIXES), read_iq),
    Reader("text", (".csv", ".txt"), read_text),
)


def reader_for(path: Path, head: bytes, form: str | None = None) -> tuple[Reader, str | None]:
    """Return the reader of a file, and a line for the user if its suffix and content disagree.

    The suffix decides; of several readers of a suffix, the first that recognises the content. If
    none of them does, or the suffix is unknown, a reader that recognises the content is taken.
    Those of other packages are imported for suffixes that are not ours.

    Parameters
    ----------
    path : path
        Name of the file.
    head : bytes
        Its first bytes.
    form : str, optional
        Takes the place of the suffix and of the content, such as cs16.

    Returns
    -------
    reader : Reader
    note : str or None

    Raises
    ------
    ValueError
        If there is no reader.

    Examples
    --------
    >>> reader_for(Path("a.wav"), b"RIFF....WAVEfmt ")[0].name
    'WAV'
    >>> reader_for(Path("a.csv"), b"RIFF....WAVEfmt ")[1]
    'the suffix is .csv, the content is WAV'
    """
    suffix = path.suffix.lower() if form is None else f".{form.lower()}"
    by_suffix = _with_suffix(READERS, suffix)
    others: list[Reader] = []
    if not by_suffix:
        others = list(_of_other_packages())
        by_suffix = _with_suffix(others, suffix)
    if form is not None and not by_suffix:
        known = sorted({each[1:] for reader in (*READERS, *others) for each in reader.suffixes})
        raise ValueError(f"format must be one of {', '.join(known)}; got {form!r}")
    recognised = next((reader for reader in by_suffix if reader.takes(head)), None)
    if recognised is not None:
        return recognised, None
    by_content = next((reader for reader in (*READERS, *others) if reader.takes(head)), None)
    if by_content is not None and form is None:
        name = by_content.name
        shown = f"the suffix is {suffix}" if suffix else "there is no suffix"
        return by_content, f"{shown}, the content is {name}"
    if by_suffix:
        return by_suffix[0], None
    suffixes = [each for reader in (*READERS, *others) for each in reader.suffixes]
    raise ValueError(f"suffix must be one of {', '.join(dict.fromkeys(suffixes))}; got {suffix!r}")


def _with_suffix(readers: Iterable[Reader], suffix: str) -> list[Reader]:
    return [reader for reader in readers if suffix in reader.suffixes]


def _of_other_packages() -> Iterator[Reader]:
    """Yield the readers that entry points name; one that cannot be loaded is a warning."""
    for points in installed(GROUP).values():
        for point in points:
            try:
                reader = loaded(point, "reader")
                if not isinstance(reader, Reader):
                    raise ValueError(f"the reader {point.name!r}, {point.value}, is not a Reader")
            except ValueError as error:
                warnings.warn(str(error), stacklevel=2)
            else:
                yield reader
