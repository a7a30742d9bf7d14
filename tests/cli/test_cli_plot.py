"""`arrivals track --plot`: beam power of the recording or of each step, titles, refusals."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from command_line import DOA, WINDOW, assert_rejected, pressure, track
from matplotlib.figure import Figure

from arrivals.__main__ import main

OUT = ("--out", "t.csv", "--plot", "t.png")


@pytest.fixture
def quiet(here: Path, scene: Path) -> list[str]:
    """Write a recording whose first half is quiet, and return its arguments."""
    samples = pressure(np.repeat(DOA, WINDOW))
    samples[: len(samples) // 2] *= 1e-3
    np.save(here / "quiet.npy", samples)
    return ["track", "quiet.npy", "--array", str(scene / "array.toml"), "--rate", "8000"]


@pytest.fixture
def figures(monkeypatch: pytest.MonkeyPatch) -> list[Figure]:
    kept: list[Figure] = []
    write = Figure.savefig

    def keep(figure: Figure, *paths: Any, **more: Any) -> None:
        kept.append(figure)
        write(figure, *paths, **more)

    monkeypatch.setattr(Figure, "savefig", keep)
    return kept


def test_normalize_step_shows_quiet_steps_and_titles_say_the_settings(
    quiet: list[str], figures: list[Figure]
) -> None:
    levels, tone = [], ("--frequency", "1000", "--window", "256", "--tracker", "svalse")
    for more in ((), ("--normalize", "step")):
        assert main([*quiet, *tone, *OUT, *more, "--quiet"]) == 0
        ax = figures[-1].axes[0]
        assert ax.get_title().replace("\n", " ") == "SVALSE, 8 sensors on a line, 1 kHz"
        image = ax.collections[0]
        levels.append(np.asarray(image.get_array()).reshape(361, -1).max(axis=0))
    whole, each = levels
    assert (whole[:9] < -50).all()
    np.testing.assert_allclose(each, 0, atol=1e-9)
    assert figures[-1].axes[1].get_ylabel().endswith("of the step")


@pytest.mark.parametrize(
    ("more", "words"),
    [
        (("--out", "t.csv", "--normalize", "step"), ("--normalize requires --plot",)),
        ((*OUT, "--normalize", "step", "--unknowns", "sphere"), ("not on the sky",)),
    ],
)
def test_normalize_without_a_beam_is_refused(
    scene: Path, here: Path, capsys: pytest.CaptureFixture[str],
    more: tuple[str, ...], words: tuple[str, ...],
) -> None:  # fmt: skip
    assert_rejected(track(scene, *more), capsys, here, *words)


def test_normalize_of_real_samples_is_refused(
    quiet: list[str], here: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    more = ("--band", "500", "900", "--tracker", "interpolation_ekf", "--normalize", "step")
    assert_rejected(
        [*quiet, *OUT, *more], capsys, here, "--normalize requires a tracker of snapshots"
    )
