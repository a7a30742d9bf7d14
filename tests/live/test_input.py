"""Bytes with their times, lag behind a live source, and audio devices that are simulated."""

import io
import os
import sys
import threading
import time
from collections.abc import Iterator
from types import ModuleType
from typing import Any, ClassVar

import numpy as np
import pytest

from arrivals.live.input.device import device_input
from arrivals.live.input.lag import LagMeter
from arrivals.live.input.timed_input import TimedInput

# bytes with their times


def test_timed_input_returns_the_bytes_of_its_source_in_any_sizes() -> None:
    content = np.random.default_rng(0).bytes(300_000)
    source = TimedInput(io.BytesIO(content), max_bytes=1000)
    sizes = [1, 70_000, 3, 0, 200_000, 10**6]
    parts = [source.read(size) for size in sizes]
    assert b"".join(parts) == content
    assert [len(part) for part in parts[:-1]] == sizes[:-1]
    assert source.read(1) == b""


def test_timed_input_of_a_pipe_waits_for_all_bytes_and_keeps_when_they_came() -> None:
    end, begin = os.pipe()
    with os.fdopen(end, "rb") as pipe, os.fdopen(begin, "wb", buffering=0) as writer:
        source = TimedInput(pipe)
        writer.write(b"ab")
        assert source.read(1) == b"a"
        first = source.received
        threading.Timer(0.05, writer.write, (b"cd",)).start()
        assert source.read(3) == b"bcd"
        assert source.received > first
        writer.close()
        assert source.read(1) == b""
        source.join(10.0)


def test_timed_input_raises_the_error_of_its_source_after_its_bytes() -> None:
    class Failing:
        n = 0

        def read1(self, _: int) -> bytes:
            self.n += 1
            if self.n > 1:
                raise OSError("unplugged")
            return b"abc"

    source = TimedInput(Failing())
    with pytest.raises(OSError, match="unplugged"):
        source.read(4)


def test_timed_input_keeps_at_most_its_limit_until_it_is_read() -> None:
    class Endless:
        n = 0

        def read1(self, size: int) -> bytes:
            self.n += 1
            return bytes(size)

    endless = Endless()
    source = TimedInput(endless, max_bytes=10**6)
    source.read(1)
    deadline = time.monotonic() + 10
    while endless.n < 16 and time.monotonic() < deadline:
        time.sleep(0.01)
    time.sleep(0.1)
    assert endless.n == 16  # the 16th block of 64 KiB reaches the limit
    source.close()
    source.join(10.0)


# lag


class Source:
    """Stand-in for an input: the time at which the last byte was received."""

    received = np.nan


def follow(
    received: Any, now: Any, late: str = "wait", start: float = 1.0, spacing: float = 0.1
) -> tuple[list[float], list[bool], list[str]]:
    """Return lags, whether steps have data, and messages, of 100 steps."""
    source, clock, messages = Source(), [0.0], list[str]()
    meter = LagMeter(source, late, messages.append, lambda: clock[0], start)  # type: ignore[arg-type]

    def steps() -> Iterator[tuple[float, Any]]:
        for k in range(100):
            source.received, clock[0] = received(spacing * k), now(spacing * k)
            yield spacing * k, np.ones(2, dtype=complex)

    lags, valid = [], []
    for _, z in meter.steps(steps()):
        lags.append(meter.lag)
        valid.append(bool(np.isfinite(z).all()))
    meter.close()
    return lags, valid, messages


def test_lag_of_a_live_source_is_the_time_since_its_last_sample() -> None:
    lags, valid, messages = follow(lambda t: t + 3.0, lambda t: t + 3.2)
    assert np.isnan(lags[:20]).all()  # two seconds show that it is live
    np.testing.assert_allclose(lags[25:], 0.2)
    assert all(valid)
    assert messages == []


def test_lag_of_a_file_in_a_pipe_is_unknown_and_without_consequence() -> None:
    lags, valid, messages = follow(lambda t: 0.001 * t, lambda t: 0.3 * t, "drop")
    assert np.isnan(lags).all()
    assert all(valid)
    assert messages == []


def test_lag_of_a_file_in_a_pipe_is_unknown_after_a_pause_of_the_pipe() -> None:
    lags, _, messages = follow(
        lambda t: 0.01 * t + 5.0 * (t > 30.0), lambda t: 0.01 * t + 9.0, spacing=1.0
    )
    assert np.isnan(lags).all()
    assert messages == []


@pytest.mark.parametrize("late", ["wait", "drop"])
def test_lag_above_half_a_second_has_one_message(late: str) -> None:
    lags, valid, messages = follow(lambda t: t, lambda t: 1.2 * t, late)
    n_late = int((np.array(lags) > 0.5).sum())
    assert n_late > 50
    assert valid.count(False) == (n_late if late == "drop" else 0)
    assert "s behind the source at 2." in messages[0]
    assert len(messages) == (2 if late == "drop" else 1)
    if late == "drop":
        assert messages[1] == f"{n_late} late steps were left out"


def test_lag_while_a_run_starts_has_no_consequence() -> None:
    _, valid, messages = follow(lambda t: t, lambda t: t + 2.0, "drop", start=20.0)
    assert all(valid)
    assert messages == []


def test_lag_meter_rejects_another_policy() -> None:
    with pytest.raises(ValueError, match=r"late must be one of 'wait', 'drop'; got 'skip'"):
        LagMeter(TimedInput(io.BytesIO(b"")), "skip")


# audio devices


class FakeStream:
    """Stream of a simulated device: a ramp on each channel, some of which is lost."""

    def __init__(self, samplerate: float, device: Any, channels: int, dtype: str) -> None:
        assert dtype == "float32"
        if channels > 4:
            raise FakeSoundDevice.PortAudioError("Invalid number of channels")
        self.channels, self.n, self.open = channels, 0, False

    def start(self) -> None:
        self.open = True

    def stop(self) -> None:
        self.open = False

    def close(self) -> None:
        FakeSoundDevice.closed.append(self)

    def read(self, n: int) -> tuple[bytes, bool]:
        assert self.open
        time.sleep(0.001)
        self.n += n
        ramp = np.arange(self.n - n, self.n, dtype="<f4")
        return np.repeat(ramp[:, None], self.channels, axis=1).tobytes(), self.n > 2 * n


class FakeSoundDevice(ModuleType):
    """What is used of sounddevice."""

    class PortAudioError(Exception):
        """Error of the library below it."""

    RawInputStream = FakeStream
    closed: ClassVar[list[FakeStream]] = []

    @staticmethod
    def query_devices(device: Any, kind: str) -> dict[str, float]:
        if device not in (3, "miniDSP"):
            raise ValueError(f"No {kind} device matching {device!r}")
        return {"default_samplerate": 16000.0}


@pytest.fixture
def sounddevice(monkeypatch: pytest.MonkeyPatch) -> type[FakeSoundDevice]:
    monkeypatch.setitem(sys.modules, "sounddevice", FakeSoundDevice("sounddevice"))
    FakeSoundDevice.closed = []
    return FakeSoundDevice


@pytest.mark.parametrize("name", ["3", "miniDSP"])
def test_device_input_has_interleaved_samples_and_the_usual_rate(
    name: str, sounddevice: type[FakeSoundDevice]
) -> None:
    messages = list[str]()
    with device_input(name, 2, report=messages.append) as (source, rate):
        samples = np.frombuffer(source.read(8 * 1000), "<f4").reshape(-1, 2)
    assert rate == 16000.0
    np.testing.assert_array_equal(samples, np.arange(1000)[:, None] * [1, 1])
    assert messages == ["the device has lost samples: times are too early from here on"]
    assert [stream.open for stream in sounddevice.closed] == [False]


@pytest.mark.parametrize(
    ("name", "n_channels", "words"),
    [("loopback", 2, "No input device matching 'loopback'"), ("3", 8, "Invalid number of")],
)
def test_device_input_that_cannot_be_opened_is_rejected(
    name: str, n_channels: int, words: str, sounddevice: type[FakeSoundDevice]
) -> None:
    with (
        pytest.raises(ValueError, match=f"--device must be an input with .*{words}"),
        device_input(name, n_channels),
    ):
        pass


@pytest.mark.usefixtures("sounddevice")
def test_device_that_fails_while_it_records_is_an_error_of_one_line(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def fail(*_: Any) -> None:
        raise FakeSoundDevice.PortAudioError("Device unavailable")

    monkeypatch.setattr(FakeStream, "read", fail)
    monkeypatch.setattr(FakeStream, "stop", fail)
    with (
        pytest.raises(OSError, match="the device has failed: Device unavailable"),
        device_input("3", 2) as (source, _),
    ):
        source.read(8)


def test_device_input_without_the_package_names_the_extra(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "sounddevice", None)
    with pytest.raises(ValueError, match=r"pip install \"arrivals\[device\]\""):
        device_input("3", 2).__enter__()


def test_device_input_without_portaudio_says_so(monkeypatch: pytest.MonkeyPatch) -> None:
    class Finder:
        def find_spec(self, name: str, *_: Any) -> None:
            if name == "sounddevice":
                raise OSError("PortAudio library not found")

    monkeypatch.delitem(sys.modules, "sounddevice", raising=False)
    monkeypatch.setattr(sys, "meta_path", [Finder(), *sys.meta_path])
    with pytest.raises(ValueError, match="requires the library PortAudio: PortAudio library not"):
        device_input("3", 2).__enter__()
