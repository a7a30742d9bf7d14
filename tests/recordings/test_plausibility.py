"""Plausibility of an array's size against the wavelengths."""

import warnings
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from arrivals.cli.main import run as run_cli
from arrivals.measurement_models import ArraySnapshot, SensorArray
from arrivals.recordings.choice import MeanSpectrum, TrackOptions, choose
from arrivals.recordings.choice.plausibility import implausible_size
from arrivals.scenarios import create

NOISE = np.random.default_rng(3).standard_normal((16000, 8))
LIGHT = 299792458.0
USUAL: dict[
    str, tuple[SensorArray, float | list[float]]
] = {  # array, rate of real samples or frequencies
    "microphones": (SensorArray.uca(8, 0.046, speed=343.0), 16000.0),
    "at 48 kHz": (SensorArray.uca(8, 0.046, speed=343.0), 48000.0),
    "wide line": (SensorArray.ula(8, 0.4, speed=343.0), 16000.0),
    "hydrophones": (SensorArray.ula(8, 1.875, speed=1489.0), 1500.0),
    "infrasound": (SensorArray.uca(4, 60.0, speed=345.0), 25.0),
    "seismometers": (SensorArray.uca(9, 3500.0, speed=6500.0), 20.0),
    "antennas": (SensorArray.uca(5, 0.35, speed=LIGHT), [433.92e6]),
    "Bluetooth": (SensorArray.uca(8, 0.05, speed=LIGHT), [2.404e9, 2.48e9]),
    "sparse line": (SensorArray.ula(8, 2.0, speed=343.0), [343.0, 400.0]),
}


def message(array: SensorArray, use: float | list[float]) -> str | None:
    """Return the warning of a choice, or the error."""
    rate, options = use, TrackOptions("svalse", use) if isinstance(use, list) else TrackOptions()
    if isinstance(rate, list):
        return implausible_size(array, rate)
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        try:
            choose(array, rate, MeanSpectrum.of(NOISE, rate), options)
        except ValueError as error:
            return str(error)
    return str(caught[0].message) if caught else None


@pytest.mark.parametrize("name", USUAL)
def test_usual_array_gets_no_warning_and_other_units_do(name: str) -> None:
    array, use = USUAL[name]
    assert message(array, use) is None
    for factor in (100.0, 1000.0, 0.001):
        scaled = SensorArray(factor * array.positions, array.speed)
        assert "unit" in (message(scaled, use) or "")


@given(st.floats(1e-3, 1e3), st.floats(1e-3, 1e3))
def test_verdict_depends_on_wavelengths_alone(size: float, scale: float) -> None:
    array = SensorArray.uca(5, size, speed=300.0)
    scaled = SensorArray(scale * array.positions, 300.0 * scale)
    verdicts = [implausible_size(each, [100.0, 200.0]) is None for each in (array, scaled)]
    assert verdicts[0] == verdicts[1]


def test_room_gets_no_warning() -> None:
    scenario = create("room", duration=1.0)
    model = scenario.sample(np.random.default_rng(0)).measurement
    assert isinstance(model, ArraySnapshot)
    array = model.array
    assert message(array, 16000.0) is None


def test_recording_with_no_power_in_the_usable_band_gets_a_warning() -> None:
    array = SensorArray.uca(8, 0.92, speed=343.0)  # alias limit 244 Hz
    high = NOISE[2:] - NOISE[:-2]
    high = high[2:] - 2 * high[1:-1] + high[:-2]  # little power below 366 Hz
    with pytest.warns(
        UserWarning, match=r"0\.704 m apart, for frequencies below 365 Hz, of 8000 Hz"
    ):
        choose(array, 16000.0, MeanSpectrum.of(high, 16000.0))


def test_track_prints_one_line_about_centimetres(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "array.toml"
    file.write_text('kind = "uca"\nn_sensors = 8\nradius = 4.6\nspeed = 343.0')
    np.save(tmp_path / "noise.npy", NOISE)
    arguments = ["track", str(tmp_path / "noise.npy"), "--rate", "16000", "--array", str(file),
                 "--out", str(tmp_path / "tracks.csv"), "--quiet"]  # fmt: skip
    run_cli(arguments)
    lines = [line for line in capsys.readouterr().err.splitlines() if "unit" in line]
    assert len(lines) == 1
    assert "3.52 m apart" in lines[0]
    assert 'add unit = "cm"' in lines[0]
    file.write_text(file.read_text() + '\nunit = "cm"')
    run_cli(arguments)
    assert "unit" not in capsys.readouterr().err
