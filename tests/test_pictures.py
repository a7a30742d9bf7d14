"""Pictures of the README: sizes, colours, and titles that fit."""

import runpy
from pathlib import Path
from typing import Any, cast

import numpy as np
import pytest
from PIL import Image

FOLDER = Path(__file__).parents[1] / "docs" / "readme"


@pytest.fixture(scope="module")
def script() -> dict[str, Any]:
    return runpy.run_path(str(FOLDER / "draw.py"))


@pytest.mark.parametrize("name", ["room", "tow", "sky", "map"])
def test_picture_is_small_and_has_two_pixels_for_one(name: str) -> None:
    with Image.open(FOLDER / f"{name}.png") as image:
        assert image.size == (800, 620)
    assert (FOLDER / f"{name}.png").stat().st_size < 100_000


def test_moving_picture_is_small_and_repeats() -> None:
    with cast(Any, Image.open(FOLDER / "map.gif")) as image:
        assert (image.size, image.n_frames, image.info["loop"]) == ((400, 310), 40, 0)
    assert (FOLDER / "map.gif").stat().st_size < 500_000


def test_titles_fit_and_pixels_keep_the_colours_of_the_tracks(script: dict[str, Any]) -> None:
    from matplotlib import rc_context
    from matplotlib.colors import to_rgb

    from arrivals.plots.colours import PALETTE

    with rc_context(script["STYLE"]):
        ax = cast(Any, script["sky"]())
        pixels = np.asarray(script["image_of"](ax, 100).convert("RGB"))
        for text in (ax.title, *ax.texts):
            box = text.get_window_extent()
            assert box.x0 >= 0
            assert box.x1 <= ax.figure.bbox.x1
    for colour in ("white", *PALETTE[:4]):  # four tracks
        distance = np.abs(pixels - 255 * np.array(to_rgb(colour))).max(axis=-1)
        assert (distance <= 1).sum() > 20


def test_first_steps_are_those_of_the_run(script: dict[str, Any]) -> None:
    from arrivals.measurement_models import ArraySnapshot, SensorArray
    from arrivals.trackers import CBF

    model = ArraySnapshot(SensorArray.ula(8, spacing=0.5), wavelength=1.0)
    run = CBF(model).run([model.steering_vector(doa) for doa in (0.1, 0.2, 0.3)])
    part = script["first_steps"](run, 2)
    assert len(part) == 2
    np.testing.assert_array_equal(part.doa, run.doa[:2])
    np.testing.assert_array_equal(part.n_found, [1, 1])
