"""Beamformers for comparison, and studies of the interpolation-delay filter."""

import io
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from matplotlib.collections import LineCollection

from arrivals.measurement_models import ArraySnapshot, SensorArray
from arrivals.recordings.sample_stream import band_samples, live_samples, track_samples
from arrivals.scenarios import create, read
from arrivals.scenarios.reproduce.interpolation import convergence, rmse, table_1
from arrivals.scenarios.reproduce.interpolation.beamformers import scan
from arrivals.scenarios.reproduce.interpolation.plots import draw_rmse, make_figure
from arrivals.scenarios.reproduce.interpolation.trials import (
    SOURCES,
    bound_deg,
    draws,
    rms,
    scan_records,
)
from arrivals.scenarios.reproduce.studies import reproduce
from arrivals.scenarios.simulations.sampled_source import received_waveforms
from arrivals.trackers import CBF, MVDR, InterpolationEKF

MODEL = ArraySnapshot(SensorArray.ula(10, spacing=0.5), wavelength=1.0, noise=0.1)


def test_fig_8_conventional_scan_attains_the_bound_for_a_tone() -> None:
    scenario = SOURCES["tone"]
    error = scan_records(scenario, draws(scenario, 40, 0), "conventional") - 60
    assert rms(error) < 1.4 * bound_deg(scenario)


def test_table_1_zero_variance_of_mvdr_is_due_to_the_grid() -> None:
    scenario = SOURCES["tone"].replace(doa_deg=30.0)
    samples = draws(scenario, 20, 0)
    np.testing.assert_allclose(
        scan_records(scenario, samples, "mvdr", refine=False), 30.0, atol=1e-12
    )
    assert 0.05 < scan_records(scenario, samples, "mvdr").std() < 0.25


@pytest.mark.parametrize("method", ["conventional", "mvdr"])
@pytest.mark.parametrize("name", ["tone", "band", "qpc"])
def test_scan_estimates_directions_on_both_sides(name: str, method: Any) -> None:
    for doa_deg in (-40.0, 25.0):
        scenario = SOURCES[name].replace(doa_deg=doa_deg)
        z = scenario.sample(np.random.default_rng(1)).measurements
        doa = scan(z, scenario.measurement, method)
        assert np.rad2deg(doa) == pytest.approx(doa_deg, abs=2)


def test_mvdr_resolves_sources_within_a_beam_width() -> None:
    doa = np.tile(np.deg2rad([10.0, 18.0]), (400, 1))
    rng = np.random.default_rng(0)
    phases = np.exp(2j * np.pi * rng.random(doa.shape))
    z = MODEL.replace(noise=1e-3).simulate(doa, phases, rng)
    tracker = MVDR(MODEL, loading=1e-4, forgetting=1.0, max_sources=2)
    np.testing.assert_allclose(np.sort(np.rad2deg(tracker.run(z).doa[-1])), [10, 18], atol=0.5)


def test_mvdr_of_one_snapshot_equals_the_conventional_beam() -> None:
    z = MODEL.array.steering_vector(0.3, 1.0)
    one, other = MVDR(MODEL, max_sources=1), CBF(MODEL, max_sources=1)
    for tracker in (one, other):
        tracker.update(z)
    np.testing.assert_allclose(one.estimate.doa, other.estimate.doa, atol=1e-3)
    np.testing.assert_allclose(abs(one.estimate.amplitude), 1.0, atol=0.1)


def test_mvdr_handles_missing_sensors_and_zero_power() -> None:
    z = MODEL.simulate(np.full((30, 1), 0.4), 1.0, np.random.default_rng(0))
    z[5:, 3] = np.nan
    run = MVDR(MODEL, max_sources=1).run(z)
    assert run.doa[-1, 0] == pytest.approx(0.4, abs=0.02)
    zero = MVDR(MODEL)
    zero.update(np.zeros(10))
    assert zero.estimate.n_found == 0


def test_scan_invalid_argument_is_rejected() -> None:
    model = SOURCES["tone"].measurement
    with pytest.raises(ValueError, match=r"\(n_steps, 10\)"):
        scan(np.zeros((5, 3)), model)
    with pytest.raises(ValueError, match="method"):
        scan(np.zeros((5, 10)), model, "music")  # type: ignore[arg-type]


@pytest.fixture
def few_cases(monkeypatch: pytest.MonkeyPatch) -> None:
    """Shorten the studies to one or two angles, levels and lengths."""
    monkeypatch.setattr(table_1, "ANGLES", (15.0, 30.0))
    monkeypatch.setattr(convergence, "SNRS_DB", (0.0, 5.0))
    monkeypatch.setattr(rmse, "LENGTHS", (25, 50))
    monkeypatch.setattr(rmse, "SNRS_DB", (5.0,))


@pytest.mark.usefixtures("few_cases")
@pytest.mark.parametrize("name", ["table1", "table2", "convergence", "rmse"])
def test_study_writes_table_page_and_figures(name: str, tmp_path: Path) -> None:
    written = reproduce(f"interpolation-{name}", tmp_path / "new", runs=2)
    assert [path.suffix for path in written[:2]] == [".csv", ".md"]
    assert all(path.stat().st_size > 500 for path in written)
    page = written[1].read_text()
    assert "**Claims of the paper**" in page
    assert "by the paper's form" in page


def test_pictures_say_what_they_show(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(
        table_1, "final_directions", lambda scene, runs, *_: scene.doa_deg + np.arange(runs)
    )
    report = table_1.table1(2, 0)
    assert report.captions["fig1"] == "sketch of the array, no data"
    titles = [ax.get_title() for ax in report.figures["table1"].axes]
    assert titles[0] == "coupled tones: with the loop as printed"
    assert titles[5] == "a tone: variance"
    assert any("coupled tones, frozen: " in remark for remark in report.remarks)


def test_error_bar_that_reaches_zero_leaves_a_logarithmic_axis() -> None:
    _, (ax,) = make_figure(1, 1, (4.0, 3.0))
    draw_rmse(ax, [1.0, 2.0], np.array([[1.0, 0.01], [1.1, 0.01], [0.9, 3.0]]), "B")
    (bars,) = [part for part in ax.collections if isinstance(part, LineCollection)]
    lowest = [segment[0, 1] for segment in bars.get_segments()]
    assert lowest[0] == pytest.approx(np.sqrt(1.00667 - 2 * 0.2003 / np.sqrt(3)), abs=1e-3)
    assert lowest[1] == pytest.approx(0.0, abs=1e-12)


def test_interpolation_scenario_invalid_parameter_is_rejected() -> None:
    with pytest.raises(ValueError, match="doa_deg"):
        create("interpolation_tone", doa_deg=91.0)
    with pytest.raises(ValueError, match="reference"):
        create("interpolation_tone", reference="last")


def test_wav_file_is_tracked_sample_by_sample(tmp_path: Path) -> None:
    """A band from -25 degrees, 16-bit samples of unknown level, as `arrivals track` reads them."""
    from scipy.io import wavfile

    array = SensorArray.ula(8, spacing=0.1, speed=340.0)
    rate, band = 8000, (600.0, 1600.0)
    model = band_samples(array, rate, band, snr_db=10.0)
    rng = np.random.default_rng(0)
    frequencies, weights = rng.uniform(600, 1600, 300) / rate, rng.standard_normal((300, 2))
    lead = rate / 340 * np.sin(np.deg2rad(-25)) * array.positions.T
    waves = received_waveforms(frequencies, weights @ np.array([1, 1j]), lead, 800)
    waves += 0.3 * waves.std() * rng.standard_normal(waves.shape)
    wavfile.write(tmp_path / "a.wav", rate, (1000 * waves / waves.std()).astype(np.int16))
    recording = read(tmp_path / "a.wav")
    samples = array.select(recording.samples)
    run = track_samples(InterpolationEKF(model), samples, rate, every=100)
    assert run.doa.shape == (8, 1)
    assert np.rad2deg(run.doa[-1, 0]) == pytest.approx(-25, abs=1)
    assert run.time[-1] == pytest.approx(799 / rate)


def test_stream_yields_whole_frames_only() -> None:
    stream = io.BytesIO(np.arange(7, dtype="<i2").tobytes())
    assert len(list(live_samples(stream, 3))) == 2
    with pytest.raises(ValueError, match="dtype"):
        next(live_samples(stream, 3, dtype="complex64"))
    with pytest.raises(ValueError, match="half the rate"):
        band_samples(SensorArray.ula(4, 0.1, speed=340.0), 8000.0, (600.0, 4600.0))
