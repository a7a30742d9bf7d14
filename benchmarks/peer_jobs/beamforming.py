"""MUSIC, MVDR and CBF on blocks of 50 snapshots, beside pyroomacoustics and acoular."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from importlib.util import find_spec
from typing import Any

import numpy as np

from arrivals.trackers import CBF, MUSIC, MVDR, DirectionTracker
from arrivals.typing import Complex
from peer_jobs import Job
from peer_jobs.blocks import (
    BIN_WIDTH,
    FREQUENCY,
    N_SNAPSHOTS,
    SPEED,
    block_model,
    circle_model,
    step,
    two_sources,
    two_wideband_sources,
)

N_FFT, RATE, N_DIRECTIONS = 16, 8000.0, 361
BIN = round(FREQUENCY * N_FFT / RATE)
FAR = 1e4  # m: directions of plane waves as points
WHAT = "15 sensors, 50 snapshots, 361 directions"


def jobs() -> list[Job]:
    """Return the jobs of the peers that are installed."""
    block, model = two_sources(), block_model()
    # each block on its own, as for the peers
    music = MUSIC(model, n_sources=2, forgetting=0.0)
    mvdr = MVDR(model, forgetting=0.0, max_sources=2)
    cbf = CBF(model, max_sources=2)
    made = []
    if find_spec("pyroomacoustics"):
        peer = "pyroomacoustics"
        made.append(_job("MUSIC", music, block, _room(block, "MUSIC"), peer, 0.35))
        made.append(_job("CBF", cbf, block, _room(block, "SRP"), f"{peer}, SRP", 0.5))
        made += _wideband()
    if find_spec("acoular"):
        made += [
            _job(name, tracker, block, peer, "acoular", 0.5)
            for name, tracker, peer in _acoular(block, mvdr, cbf)
        ]
    return made


def _job(
    name: str,
    tracker: DirectionTracker,
    block: Complex,
    peer: Callable[[], object],
    peer_name: str,
    limit: float,
) -> Job:
    return Job(f"{name}, {WHAT}", lambda: step(tracker, block), peer, peer_name, limit)


def _room(block: Complex, method: str) -> Callable[[], object]:
    """Return a method of pyroomacoustics, with azimuths counted from the line."""
    import pyroomacoustics

    x = block_model().array.positions[:, 0]
    finder = getattr(pyroomacoustics.doa, method)(
        np.stack([x, np.zeros_like(x)]), RATE, N_FFT, c=SPEED, num_src=2,
        azimuth=np.linspace(0, np.pi, N_DIRECTIONS),
    )  # fmt: skip
    spectra = np.zeros((len(x), N_FFT // 2 + 1, len(block)), dtype=complex)
    spectra[:, BIN] = block.T

    def locate() -> object:
        finder.locate_sources(spectra, freq_bins=[BIN])
        return np.sort(np.pi / 2 - finder.azimuth_recon)

    return locate


def _wideband() -> list[Job]:
    """Return MUSIC and CBF of 20 bins at once, on a circle, beside pyroomacoustics."""
    import pyroomacoustics

    model, block = circle_model(), two_wideband_sources()
    trackers: list[tuple[DirectionTracker, str, float]] = [
        (MUSIC(model, n_sources=2, forgetting=0.0, n_directions=360), "NormMUSIC", 0.35),
        (CBF(model, n_directions=360, max_sources=2), "SRP", 0.5),
    ]
    rate, n_fft, bins = 512 * BIN_WIDTH, 512, np.arange(20, 60, 2)
    spectra = np.zeros((6, n_fft // 2 + 1, N_SNAPSHOTS), dtype=complex)
    spectra[:, bins] = block.transpose(2, 0, 1)
    made = []
    for tracker, method, limit in trackers:
        finder = getattr(pyroomacoustics.doa, method)(
            model.array.positions.T, rate, n_fft, c=SPEED, num_src=2,
            azimuth=np.linspace(-np.pi, np.pi, 360, endpoint=False),
        )  # fmt: skip
        made.append(
            Job(
                f"{type(tracker).__name__}, 20 bins, 6 sensors on a circle, 50 snapshots",
                lambda tracker=tracker: step(tracker, block),  # type: ignore[misc]
                lambda finder=finder: finder.locate_sources(spectra, freq_bins=bins),  # type: ignore[misc]
                f"pyroomacoustics, {method}",
                limit,
            )
        )
    return made


def _acoular(
    block: Complex, mvdr: MVDR, cbf: CBF
) -> Iterator[tuple[str, DirectionTracker, Callable[[], object]]]:
    """Yield name, tracker, and beamformer of acoular: covariance and spectrum, without peaks."""
    import acoular

    acoular.config.global_caching = "none"
    x = block_model().array.positions[:, 0]
    mics = acoular.MicGeom(pos_total=np.stack([x, 0 * x, 0 * x]))
    doa = cbf.doa_grid
    points = FAR * np.stack([np.sin(doa), 0 * doa, np.cos(doa)])
    steer = acoular.SteeringVector(grid=acoular.ImportGrid(pos=points), mics=mics)
    for name, tracker, kind in (
        ("MVDR", mvdr, acoular.BeamformerCapon),
        ("CBF", cbf, acoular.BeamformerBase),
    ):
        yield name, tracker, _spectrum_of(acoular, kind, steer, block)


def _spectrum_of(acoular: Any, kind: Any, steer: Any, block: Complex) -> Callable[[], object]:
    def spectrum() -> object:
        R = block.T @ block.conj() / len(block)
        data = acoular.PowerSpectraImport(csm=R[None], frequencies=FREQUENCY)
        beamformer = kind(freq_data=data, steer=steer, cached=False, r_diag=False)
        return beamformer.synthetic(FREQUENCY, 0)

    return spectrum
