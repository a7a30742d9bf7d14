"""Scenarios of the report: autoregressive sources, speech and a symmetric line."""

from pathlib import Path

import numpy as np
import pytest
from scipy.io import wavfile

from arrivals.scenarios import Scenario, create, nmse
from arrivals.scenarios.reproduce.ar_kalman.experiments import Experiment, run_tracker
from arrivals.scenarios.simulations import (
    AutoregressiveField,
    FastSource,
    FourOnThree,
    SpeechField,
    ThreeOnThree,
)

NAMES = [*(f"ar_fig{n}" for n in (1, 3, 4, 5, 6, 7, 8, 9)), "ar_three_on_three", "ar_four_on_three"]


@pytest.mark.parametrize("name", NAMES)
def test_trial_is_consistent_with_its_models(name: str) -> None:
    scene: Scenario = create(name)
    trial = scene.sample(np.random.default_rng(0))
    sent = np.asarray(trial.signals)
    assert trial.truth.shape == sent.shape == (len(trial.measurements), trial.motion.n_sources)  # type: ignore[attr-defined]
    np.testing.assert_allclose((np.abs(sent) ** 2).mean(axis=0), 1.0, atol=0.5)
    noise = trial.measurements - trial.measurement.wave(trial.truth, sent)  # type: ignore[union-attr]
    assert (np.abs(noise) ** 2).mean() == pytest.approx(trial.measurement.noise, rel=0.1)  # type: ignore[union-attr]


def test_equal_seeds_give_equal_trials() -> None:
    one, other = (FastSource().sample(np.random.default_rng(3)) for _ in range(2))
    np.testing.assert_array_equal(one.measurements, other.measurements)


def test_real_valued_sources_have_real_signals() -> None:
    scene = AutoregressiveField(real_valued=True, n_intervals=4)
    assert np.asarray(scene.sample(np.random.default_rng(0)).signals).dtype == np.float64


@pytest.mark.parametrize(
    ("params", "message"),
    [
        ({"doa_deg": (-20.0, 91.0)}, "90 degrees"),
        ({"end_deg": (0.0,)}, "one direction for each of 2"),
        ({"coefficients": ((0.5,),)}, "one list for each of 2"),
        ({"coefficients": ((1.5,), (0.5,))}, "unstable"),
        ({"distances": ()}, "distances"),
        ({"n_intervals": 0}, "n_intervals"),
    ],
)
def test_field_invalid_parameter_is_rejected(params: dict[str, object], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        AutoregressiveField(**params)  # type: ignore[arg-type]  # some are wrong


def test_speech_field_reads_recordings(tmp_path: Path) -> None:
    rng = np.random.default_rng(0)
    paths = [tmp_path / "one.wav", tmp_path / "other.wav"]
    for n, path in enumerate(paths):
        wavfile.write(path, 8000, rng.integers(-999, 999, 500 + n).astype(np.int16))
    scene = SpeechField(recordings=paths)
    assert scene.signals.shape == (500, 2)
    assert scene.from_dict(scene.to_dict()) == scene
    with pytest.raises(ValueError, match="one for each of 2"):
        SpeechField(recordings=paths[:1])
    wavfile.write(paths[0], 8000, np.zeros(500, np.int16))
    with pytest.raises(ValueError, match="positive power"):
        _ = scene.signals
    wavfile.write(paths[0], 8000, np.zeros((500, 2), np.int16))
    with pytest.raises(ValueError, match="one channel"):
        _ = scene.signals


@pytest.mark.parametrize(
    ("scene", "offset", "params", "most"),
    [
        (ThreeOnThree(n_intervals=130), 3.0, {"regression__forgetting": 0.99}, 0.4),
        (FourOnThree(n_intervals=130), 5.0, {"regression__forgetting": 0.99}, 0.8),
    ],
)
def test_section_7_more_sources_than_subspace_methods_resolve(
    scene: AutoregressiveField, offset: float, params: dict[str, float], most: float
) -> None:
    trials = [scene.sample(np.random.default_rng(n)) for n in range(6)]
    runs = run_tracker(trials, Experiment(0, "", scene, params, offset), params)
    error = [r.doa[2999::30] - t.truth[2999::30] for t, r in zip(trials, runs, strict=True)]
    assert np.rad2deg(np.median(np.sqrt(np.mean(np.square(error), axis=(1, 2))))) < most
    sent = np.asarray(trials[0].signals)
    assert nmse(sent[3000:], runs[0].signals[3000:], db=True).max() < -3
    with pytest.raises(ValueError, match="n_sources"):
        trials[0].tracker("music", n_sources=scene.n_sources)
