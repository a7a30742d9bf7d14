"""SWellEx-96 tow: scenario, study and recorded fields."""

import csv
import os
import pickle
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from sklearn.base import clone

from arrivals.scenarios import create, mean_gospa
from arrivals.scenarios.demos.swellex96 import swellex96 as shipped
from arrivals.scenarios.reproduce.studies import reproduce
from arrivals.scenarios.reproduce.svalse.forms import PAPER_FORM
from arrivals.scenarios.reproduce.swellex96 import figures_11_12 as reproduce_swellex
from arrivals.scenarios.reproduce.swellex96.decisions import WITH_RANGE
from arrivals.scenarios.reproduce.swellex96.field import beam
from arrivals.scenarios.reproduce.swellex96.figures_11_12 import strong_directions
from arrivals.scenarios.simulations.swellex96 import TowPastLine, environment, line, track
from arrivals.trackers import find
from arrivals.typing import Complex, Float

RANGES = tuple(track()["range_m"].tolist())


def rng(seed: int = 0) -> np.random.Generator:
    return np.random.default_rng(seed)


# the scenario


def test_noise_level_is_snr_db_below_the_field_at_the_median_step() -> None:
    scenario = TowPastLine(ranges=RANGES[::10], snr_db=7.0)
    trial, field = scenario.sample(rng()), scenario.field()
    noise = (np.abs(trial.measurements - field) ** 2).mean()
    power = np.median((np.abs(field) ** 2).mean(axis=1))
    assert 10 * np.log10(power / noise) == pytest.approx(7.0, abs=0.3)
    assert scenario.noise == pytest.approx(noise, rel=0.1)


def test_draws_with_and_without_element_43_share_their_noise() -> None:
    scenario = TowPastLine(ranges=RANGES[:3])
    partial, whole = scenario.sample(rng()), scenario.replace(missing=()).sample(rng())
    assert (partial.measurements.shape[1], whole.measurements.shape[1]) == (63, 64)
    np.testing.assert_array_equal(partial.measurements, np.delete(whole.measurements, 42, axis=1))
    np.testing.assert_array_equal(partial.truth, whole.truth)
    np.testing.assert_array_equal(partial.measurements, scenario.sample(rng()).measurements)
    assert (partial.measurements != scenario.sample(rng(1)).measurements).all()


def test_writing_to_a_trial_does_not_change_the_next() -> None:
    scenario = TowPastLine(ranges=RANGES[:2])
    first = scenario.sample(rng())
    kept = first.measurements.copy(), first.truth.copy()
    first.measurements[:] = 0
    first.truth[:] = 0
    scenario.field()[:] = 0
    again = scenario.sample(rng())
    np.testing.assert_array_equal(again.measurements, kept[0])
    np.testing.assert_array_equal(again.truth, kept[1])


def test_shipped_snapshots_are_of_this_scenario() -> None:
    """The demo's snapshots minus our field: 10 dB below it at the median step."""
    measurement, snapshots, time = shipped()
    scenario = TowPastLine()
    np.testing.assert_allclose(time, track()["time_s"], atol=1e-3)
    np.testing.assert_array_equal(scenario.measurement.array.positions, measurement.array.positions)
    noise = snapshots - scenario.field()
    assert (np.abs(noise) ** 2).mean() == pytest.approx(scenario.noise, rel=0.02)


def test_path_angles_match_the_description_of_the_data() -> None:
    names, doa, level_db = TowPastLine().paths()
    degrees, step = np.rad2deg(doa), np.arange(1, 351)
    strongest = np.array(names)[np.nanargmax(level_db, axis=1)]
    assert (strongest[(step > 255) & (step < 330)] == "B").all()
    B = degrees[(step >= 250) & (step <= 330), names.index("B")]
    assert -17.7 < B.min() < -17.3
    assert -12.3 < B.max() < -11.7
    at_206 = degrees[205]
    assert at_206[names.index("BS")] == pytest.approx(14.6, abs=0.5)
    assert at_206[names.index("BSB")] == pytest.approx(-17.2, abs=0.5)
    assert np.nanmin(np.abs(degrees)) > 11  # the ray of smallest elevation: acos(1489/1519)


def test_truth_has_the_strong_paths() -> None:
    scenario = TowPastLine(ranges=RANGES[::25])
    near, wide = scenario.truth(10.0), scenario.truth(30.0)
    assert (np.isnan(near) | (near == wide)).all()
    assert ((~np.isnan(near)).sum(axis=1) >= 1).all()
    assert np.isnan(near).sum() > np.isnan(wide).sum()
    np.testing.assert_array_equal(scenario.sample(rng()).truth, near)


def test_highest_beam_peak_is_a_path() -> None:
    scenario = TowPastLine(ranges=RANGES[::10])
    grid, power = beam(scenario, scenario.field())
    error = np.abs(scenario.truth() - grid[power.argmax(axis=1)][:, None])
    assert np.median(np.rad2deg(np.nanmin(error, axis=1))) < 0.7


def test_field_depends_on_depth_frequency_model_and_ranges() -> None:
    base = TowPastLine(ranges=(2000.0, 2100.0))
    others: list[dict[str, Any]] = [
        {"source_depth": 54.0},
        {"frequency": 127.0},
        {"model": "rays"},
        {"ranges": (2000.0, 2200.0)},
    ]
    for change in others:
        field = base.replace(**change).field()
        assert field.shape == (2, 63)
        assert np.abs(field - base.field()).max() > 0.1 * np.abs(base.field()).max()
    assert base.replace(n_steps=1).sample(rng()).measurements.shape == (1, 63)
    assert base.replace(frequency=127.0).measurement.wavelength == pytest.approx(1489 / 127)


def test_tow_configuration_makes_the_round_trip() -> None:
    scenario = create("swellex96", ranges=[2000.0, 2100.0], missing=[1, 43], snr_db=3.0)
    for back in (
        TowPastLine.from_dict(scenario.to_dict()),
        pickle.loads(pickle.dumps(scenario)),
        clone(scenario),
    ):
        assert back == scenario
    assert hash(scenario) == hash(scenario.replace())


@pytest.mark.parametrize(
    ("change", "match"),
    [
        ({"source_depth": 300.0}, "source_depth must lie in the water"),
        ({"ranges": ()}, "number of ranges must be at least 1"),
        ({"ranges": (1000.0, np.nan)}, "ranges must be finite and positive"),
        ({"model": "parabolic"}, "model must be one of 'modes', 'rays'"),
        ({"missing": (65,)}, "missing names element 65 of 64"),
        ({"missing": (0,)}, "missing"),
        ({"frequency": 0.0}, "frequency must be finite and positive"),
        ({"n_steps": 0}, "n_steps must be at least 1"),
        ({"snr_db": np.inf}, "snr_db must be finite"),
    ],
)
def test_tow_invalid_parameter_is_rejected(change: dict[str, Any], match: str) -> None:
    with pytest.raises(ValueError, match=match):
        TowPastLine(**change)


# the study


def test_valse_and_svalse_resolve_more_distant_paths_than_the_beamformer() -> None:
    """Steps 61 to 80 of the paper's 1 to 100, where many paths lie near each other."""
    scenario = TowPastLine(ranges=RANGES[60:80])
    trial = scenario.sample(rng())
    score = {
        name: mean_gospa(
            np.rad2deg(trial.truth),
            strong_directions(trial.tracker(name).run(trial.measurements)),
            c=10.0,
        ).total
        for name in ("cbf", "valse", "svalse")
    }
    assert score["valse"] < 0.8 * score["cbf"]
    assert score["svalse"] < 0.8 * score["cbf"]


def test_swellex96_study_writes_table_claims_and_figures(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Every tenth step, with the beamformer for all methods, which take minutes."""
    monkeypatch.setattr(reproduce_swellex, "tracker_of", lambda trial, name: trial.tracker("cbf"))
    monkeypatch.setattr(reproduce_swellex, "step_numbers", lambda runs: np.arange(1, 351, 10))
    written = reproduce("swellex96", tmp_path, runs=1)
    assert [path.suffix for path in written] == [".csv", ".md", ".png", ".png", ".png"]
    with open(tmp_path / "swellex96.csv", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    methods = list(reproduce_swellex.METHODS)
    assert len(rows) == 7 * 5 + 7 + 2
    assert [row["method"] for row in rows[:35:5]] == methods
    assert [row["method"] for row in rows[35:]] == [*methods, *PAPER_FORM.values()]
    for row in rows:
        parts = [float(row[key]) for key in ("distance", "missed", "false")]
        assert float(row["GOSPA"]) == pytest.approx(sum(parts))
        assert row["std"] == ""  # of one draw
    first_100 = [row["GOSPA"] for row in rows if row["steps"] == "1-100"]
    assert len(set(first_100)) == 1  # the paper's forms have directions of these steps only
    page = (tmp_path / "swellex96.md").read_text(encoding="utf-8")
    assert "every second step" in page
    assert "more accurate than VALSE: a lower GOSPA, steps 1 to 100. **Not decided**" in page
    assert (
        "(our BS and BSB) dominate: steps 220 to 250. **Holds** by ours (simulated field: " in page
    )


def test_paper_form_at_sea_is_coordinate_ascent_from_the_first_element() -> None:
    trial = TowPastLine(ranges=RANGES[:2]).sample(rng())
    for name, label in PAPER_FORM.items():
        params = reproduce_swellex.tracker_of(trial, label).get_params(deep=True)
        assert (params["reference"], params["solver__tolerance"]) == ("first", 1e-6)
        assert type(reproduce_swellex.tracker_of(trial, label)) is find(name)


def test_svalse_with_range_has_the_motion_of_the_scene_and_a_floor_of_the_noise() -> None:
    trial = TowPastLine(ranges=RANGES[:2]).sample(rng())
    tracker = reproduce_swellex.tracker_of(trial, WITH_RANGE)
    params = tracker.get_params(deep=True)
    assert (params["measurement__unknowns"], params["solver__max_snr_db"]) == ("range", 15.0)
    assert params["motion"] == trial.motion


# the recorded arrays


FOLDER = Path(os.environ.get("ARRIVALS_DATA", "")) / "swellex96"
recorded = pytest.mark.skipif(
    "ARRIVALS_DATA" not in os.environ, reason="ARRIVALS_DATA does not name the folder"
)


def correlation(a: Complex, b: Complex) -> Float:
    size = (np.abs(a) ** 2).sum(axis=1) * (np.abs(b) ** 2).sum(axis=1)
    return np.asarray(np.abs((a.conj() * b).sum(axis=1)) / np.sqrt(size))


@recorded
def test_modal_field_matches_the_recorded_one() -> None:
    """The recorded field lacks the loss of half a cell of sediment, 0.8 % in power."""
    z, scenario = np.load(FOLDER / "s5_shallow_198hz.npz"), TowPastLine(missing=())
    clean = z["clean"].T.astype(np.complex128)
    field = scenario.field()
    assert np.abs(field - clean).max() < 2e-3 * np.abs(clean).max()
    assert correlation(field, clean).min() > 0.9999
    assert scenario.noise == pytest.approx(float(z["noise_power"]), rel=1e-2)
    assert line(missing=()).positions[:, 0] == pytest.approx(-z["depth_m"])


@recorded
def test_our_rays_match_the_modes_better_than_the_recorded_ones() -> None:
    """Recorded rays lack the phase jump at caustics: correlation 0.90, ours 0.92."""
    z, scenario = np.load(FOLDER / "s5_shallow_198hz.npz"), TowPastLine(missing=(), model="rays")
    modal, recorded_rays = (z[key].T.astype(np.complex128) for key in ("clean", "rays"))
    powers = [beam(scenario, p)[1] for p in (modal, recorded_rays, scenario.field())]
    recorded_mean, our_mean = (
        np.median([np.corrcoef(a, b)[0, 1] for a, b in zip(powers[0], other, strict=True)])
        for other in powers[1:]
    )
    assert our_mean > recorded_mean > 0.85
    level = 10 * np.log10(
        (np.abs(scenario.field()) ** 2).mean(axis=1) / (np.abs(modal) ** 2).mean(axis=1)
    )
    assert abs(level.mean()) < 1.3
    assert level.std() < 1.1


@recorded
def test_path_angles_match_the_recorded_ones() -> None:
    with open(FOLDER / "arrivals.csv", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    names, doa, _ = TowPastLine().paths()
    top = {int(row["step"]): -np.inf for row in rows}
    for row in rows:
        top[int(row["step"])] = max(top[int(row["step"])], float(row["level_db"]))
    strong = [r for r in rows if float(r["level_db"]) > top[int(r["step"])] - 15]
    ours = np.rad2deg([doa[int(r["step"]) - 1, names.index(r["path"])] for r in strong])
    assert np.isnan(ours).mean() < 0.06  # rays at or beyond their turning point
    error = np.abs(ours - [float(r["angle_deg"]) for r in strong])
    assert np.nanmax(error) < 0.05


@recorded
def test_shipped_tables_match_the_recorded_ones() -> None:
    guide, ship = environment(), track()
    ssp = np.loadtxt(FOLDER / "ssp.csv", delimiter=",", skiprows=1)
    np.testing.assert_array_equal(np.stack([guide.depths, guide.speeds], axis=1), ssp)
    with open(FOLDER / "track.csv", encoding="utf-8") as file:
        np.testing.assert_array_equal(
            ship["range_m"], [float(r["range_m"]) for r in csv.DictReader(file)]
        )
    with open(FOLDER / "array.csv", encoding="utf-8") as file:
        elements = list(csv.DictReader(file))
    assert [-float(e["depth_m"]) for e in elements] == line(missing=()).positions[:, 0].tolist()
    assert [int(e["element"]) for e in elements if e["usable"] == "0"] == [43]
