"""Scores and peers of benchmarks/rooms.py: plain GOSPA, optional talkers, and a brute-force map."""

from functools import cache

import numpy as np
import pytest
from room_talkers.peers import METHODS, PhaseTransform
from room_talkers.scores import StepTruth, bridged, score, truth_of

from arrivals.scenarios import mean_gospa
from arrivals.scenarios.simulations.rooms import RoomRecording, TalkersInRoom

SCENE = TalkersInRoom("square", n_talkers=2, duration=4.0, order=4)


@cache
def recording() -> RoomRecording:
    return SCENE.record(np.random.default_rng(0))


@pytest.mark.parametrize("seed", range(5))
def test_score_without_optional_talkers_is_gospa(seed: int) -> None:
    rng = np.random.default_rng(seed)
    doa = rng.uniform(-180, 180, (40, 2))
    active = rng.random((40, 2)) < 0.7
    found = np.where(
        rng.random((40, 3)) < 0.6, doa[:, [0, 1, 0]] + rng.normal(0, 12, (40, 3)), np.nan
    )
    result = score(StepTruth(doa, active, np.zeros_like(active)), found, None)
    spoken = active.any(axis=1)
    g = mean_gospa(np.where(active, doa, np.nan)[spoken], found[spoken], c=20.0, period=360.0)
    assert result.gospa == pytest.approx(g.total)
    assert result.false * 10 == pytest.approx(g.false)
    assert result.missed * active.sum() * 10 / spoken.sum() == pytest.approx(g.missed)
    assert np.isnan(result.switches)


def test_score_of_an_optional_talker_costs_nothing_found_or_not() -> None:
    doa = np.array([[10.0, 100.0]] * 2)
    truth = StepTruth(doa, np.array([[True, False]] * 2), np.array([[False, True]] * 2))
    label = np.array([[0, 1], [0, 1]])
    alone = score(truth, np.array([[12.0, np.nan]] * 2), label)
    both = score(truth, np.array([[12.0, 105.0]] * 2), label)
    wrong = score(truth, np.array([[12.0, 150.0]] * 2), label)
    assert (alone.gospa, both.gospa, wrong.gospa) == (2.0, 2.0, 12.0)
    assert both.switches == 0
    assert score(truth, np.array([[12.0, 105.0], [105.0, 12.0]]), label).switches == 2


def test_short_pauses_and_hangover_are_bridged() -> None:
    on = np.zeros((40_000, 1), dtype=bool)
    on[1000:3000] = on[9000:12_000] = on[24_000:26_000] = True  # pauses of 0.375 and 0.75 s
    wide = bridged(on)[:, 0]
    edges = np.flatnonzero(np.diff(wide.astype(int))) + 1
    assert edges.tolist() == [1000, 12_000 + 4800, 24_000, 26_000 + 4800]


def test_truth_of_a_recording_matches_that_of_its_trial() -> None:
    truth, trial = truth_of(recording()), SCENE.trial(recording())
    np.testing.assert_array_equal(truth.active, ~np.isnan(trial.truth))
    error = np.deg2rad(truth.doa_deg) - trial.truth
    np.testing.assert_allclose(np.cos(error[truth.active]), 1.0)
    assert truth.optional.any()
    assert not (truth.optional & truth.active).any()


def test_phase_transform_map_is_a_sum_over_pairs() -> None:
    trial = SCENE.replace(n_bins=9).trial(recording())
    model = SCENE.replace(n_bins=9).measurement
    detector = PhaseTransform(model)
    z = trial.measurements[10]
    detector.update(z)
    p, total, n = model.array.positions, np.zeros(len(detector.doa_grid)), 0
    u = np.stack([np.cos(detector.doa_grid), np.sin(detector.doa_grid)], axis=1)
    for f, wavelength in enumerate(model.wavelengths):
        for i in range(4):
            for j in range(i + 1, 4):
                lag = 2 * np.pi / wavelength * u @ (p[i] - p[j])
                for y in z[f]:
                    total += np.cos(np.angle(y[i] * y[j].conj()) - lag)
                    n += 1
    best = detector.doa_grid[np.argmax(total)]
    assert total.max() / n > detector.threshold
    assert detector.estimate.doa[0] == pytest.approx(best, abs=np.deg2rad(2))


@pytest.mark.parametrize("name", ["nothing", "svalse, recorded", "SRP-PHAT + Kalman"])
def test_methods_return_one_row_a_step(name: str) -> None:
    truth = truth_of(recording())
    found = METHODS[name](SCENE, recording(), truth.active.sum(axis=1))
    assert len(found.doa_deg) == len(truth.active)
    assert 0 <= score(truth, found.doa_deg, found.label).gospa < 40


def test_coverage_is_the_share_of_errors_within_the_deviation() -> None:
    truth = truth_of(recording())
    offset = np.where(np.arange(len(truth.active)) % 2, 1.0, 3.0)
    doa = np.where(truth.active, truth.doa_deg, np.nan)[:, :1] + offset[:, None]
    found = score(truth, doa, None, np.full_like(doa, 2.0))
    odd = truth.active[1::2, 0].sum() / truth.active[:, 0].sum()
    assert found.within68 == pytest.approx(odd)
    assert found.within95 == 1.0
    assert np.isnan(score(truth, doa, None).within68)
