"""Azimuth and elevation of talkers in simulated rooms: `arrivals.track` by each method."""

from __future__ import annotations

import argparse
import time
import warnings

import numpy as np

import arrivals
from arrivals.recordings.recording import Recording
from arrivals.scenarios import mean_gospa
from arrivals.scenarios.room_acoustics.speech_signals import RATE
from arrivals.scenarios.simulations.rooms import ARRAYS, TalkersInRoom
from arrivals.typing import Float

CUT_OFF = 20.0  # degrees
METHODS = ("wideband_mixture", "svalse")


def recording(
    array: str, rt60: float, n_talkers: int, seed: int
) -> tuple[Float, Float, Float, Float]:
    """Return samples, azimuths (n_samples, n), activity and elevations (n,) of standing talkers."""
    scene = TalkersInRoom(array=array, n_talkers=n_talkers, n_moving=0, rt60=rt60, duration=4.0)  # type: ignore[arg-type]
    layout = scene.layout(np.random.default_rng(seed))  # the first draw of the recording
    made = scene.record(np.random.default_rng(seed))
    apart = np.array([places[0] - layout.sensors.mean(axis=0) for places in layout.places])
    elevation = np.arctan2(apart[:, 2], np.hypot(apart[:, 0], apart[:, 1]))
    return made.samples, made.doa, made.active.astype(float), elevation


def scores(array: str, rt60: float, n_talkers: int, seed: int, method: str) -> list[float]:
    """Return GOSPA, missed and false degrees, errors of both angles, and CPU s per s."""
    samples, doa, active, elevation = recording(array, rt60, n_talkers, seed)
    started = time.process_time()
    run = arrivals.track(Recording(samples, RATE), ARRAYS[array], tracker=method, unknowns="sphere")
    cpu = (time.process_time() - started) / (len(samples) / RATE)
    at = np.minimum(np.rint(run.time * RATE).astype(np.int64), len(samples) - 1)
    azimuth = np.where(active[at] > 0, doa[at], np.nan)
    truth = np.stack([azimuth, azimuth * 0 + elevation], axis=-1)
    found = np.stack([run.doa, run.elevation], axis=-1)
    g = mean_gospa(
        np.rad2deg(truth), np.rad2deg(found), CUT_OFF, period=360.0, distance="great_circle"
    )
    errors = []
    for true, estimate in zip(truth, found, strict=True):
        for one in true[~np.isnan(true[:, 0])]:
            apart = np.abs(np.angle(np.exp(1j * (estimate[:, 0] - one[0]))))
            if (apart < np.deg2rad(CUT_OFF)).any():
                k = int(np.nanargmin(apart))
                errors.append((apart[k], abs(estimate[k, 1] - one[1])))
    both = np.rad2deg(np.median(errors, axis=0)) if errors else np.full(2, np.nan)
    return [g.total, g.missed, g.false, *both.tolist(), cpu]


def main() -> None:
    """Print the means of each method, and GOSPA by array and reverberation."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, nargs="+", default=[0, 1, 2])
    options = parser.parse_args()
    warnings.simplefilter("ignore")
    cases = [(a, rt60) for a in ("circle", "square") for rt60 in (0.25, 0.5)]
    print("| method | GOSPA | missed | false | azimuth | elevation | CPU s per s | "
          + " | ".join(f"{a}, {rt60:g} s" for a, rt60 in cases) + " |")  # fmt: skip
    print("|---" * (7 + len(cases)) + "|")
    for method in METHODS:
        table = np.array([
            [scores(a, rt60, n, seed, method) for n in (1, 2) for seed in options.seeds]
            for a, rt60 in cases
        ])  # fmt: skip
        means = np.nanmean(table, axis=(0, 1))
        cells = [f"{value:.2f}" for value in means]
        cells += [f"{value:.1f}" for value in table[:, :, 0].mean(axis=1)]
        print(f"| {method} | {' | '.join(cells)} |", flush=True)


if __name__ == "__main__":
    main()
