"""Recordings: files, narrowband snapshots, frames, streams, sensor networks."""

from arrivals.recordings.framing import FramedSnapshots, frame_recording, frame_stream
from arrivals.recordings.readers import read
from arrivals.recordings.recording import Recording, Snapshots

__all__ = [
    "FramedSnapshots",
    "Recording",
    "Snapshots",
    "frame_recording",
    "frame_stream",
    "read",
]
