"""Recordings: files, narrowband snapshots, frames, streams, sensor networks."""

from arrivals.recordings.formats.file_contents import FileContents, ReadingOptions
from arrivals.recordings.formats.registry import Reader
from arrivals.recordings.framing import FramedSnapshots, frame_recording, frame_stream
from arrivals.recordings.readers import read
from arrivals.recordings.recording import Recording, Snapshots
from arrivals.recordings.stored_samples import StoredSamples

__all__ = [
    "FileContents",
    "FramedSnapshots",
    "Reader",
    "ReadingOptions",
    "Recording",
    "Snapshots",
    "StoredSamples",
    "frame_recording",
    "frame_stream",
    "read",
]
