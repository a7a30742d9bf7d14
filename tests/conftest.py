"""Settings of all tests."""

import os
import sys
from collections.abc import Generator
from pathlib import Path

# One BLAS thread a process: matrices are small, and pytest runs one process a core. It is read
# when numpy is imported, here and in processes that tests start.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np
import pytest
from command_line import ARRAY, DOA, RATE, WINDOW, pressure
from hypothesis import settings
from scipy.io import wavfile

# A first call may import scipy; and CI judges a change, not the luck of a draw.
settings.register_profile("here", deadline=None)
settings.register_profile("ci", deadline=None, derandomize=True)
settings.load_profile("ci" if os.environ.get("CI") else "here")

# Their lines are those of other tests, and the tracer of coverage would take half of their time.
UNTRACED = ("test_conformance.py", "test_fuzz.py", "test_missing_sensors.py")


@pytest.hookimpl(wrapper=True)
def pytest_runtest_call(item: pytest.Item) -> Generator[None, object, object]:
    """Measure no coverage in tests that enter the same lines again and again."""
    tracer = sys.gettrace()
    if tracer is not None and item.path.name in UNTRACED:
        sys.settrace(None)
    try:
        return (yield)
    finally:
        sys.settrace(tracer)


@pytest.fixture(scope="module")
def scene(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Write a folder with an array file, and one moving source as WAV and as raw samples."""
    folder = tmp_path_factory.mktemp("scene")
    (folder / "array.toml").write_text(ARRAY)
    at = (np.arange(len(DOA) * WINDOW) - WINDOW / 2) / WINDOW
    samples = pressure(np.interp(at, np.arange(len(DOA)), DOA))
    counts = np.rint(samples * 32768).astype("<i2")
    wavfile.write(folder / "tow.wav", RATE, counts)
    (folder / "tow.raw").write_bytes(counts.tobytes())
    return folder


@pytest.fixture
def here(scene: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Go to an empty folder."""
    monkeypatch.chdir(tmp_path)
    return tmp_path
