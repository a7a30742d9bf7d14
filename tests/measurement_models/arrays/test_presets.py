"""Arrays of known hardware."""

import re
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.distance import pdist

from arrivals.measurement_models import SensorArray
from arrivals.measurement_models.arrays.description import from_description
from arrivals.measurement_models.arrays.presets import preset_names, preset_summary, preset_text

OPEN = {"kraken-5": {"radius": 0.35}}  # keys that a preset leaves open
WIDEST = {"kraken-5": 0.7, "swellex96-vla": 119.0, "swellex96-vla-21": 119.0}  # m; others 25 cm


def preset(name: str) -> SensorArray:
    return from_description({"kind": name, **OPEN.get(name, {})})


@pytest.mark.parametrize("name", preset_names())
def test_preset_is_an_array_with_a_source(name: str) -> None:
    array, lines = preset(name), preset_text(name).splitlines()
    aperture = pdist(array.positions).max()
    assert 0.05 < aperture <= WIDEST.get(name, 0.25)
    assert array.speed is not None
    assert preset_summary(name)
    assert re.match(r"# Source: .{20,}", lines[1])


def test_preset_by_name_is_its_file(tmp_path: Path) -> None:
    file = tmp_path / "array.toml"
    file.write_text('kind = "uma-8"')
    assert SensorArray.from_file("uma-8") == SensorArray.from_file(file) == preset("uma-8")


def test_preset_takes_common_keys_but_not_its_lengths() -> None:
    keys = {"kind": "respeaker-usb-v2", "channels": [1, 2, 3, 4], "rotation": 90, "speed": 340.0}
    array, plain = from_description(keys), preset("respeaker-usb-v2")
    assert (array.channels, array.speed) == ((0, 1, 2, 3), 340.0)
    assert plain.channels == (1, 2, 3, 4)
    turned = plain.positions @ np.array([[0.0, 1.0], [-1.0, 0.0]])
    np.testing.assert_allclose(array.positions, turned, atol=1e-15)
    for key in ("unit", "positions", "radius"):
        with pytest.raises(ValueError, match=f"'respeaker-usb-v2' has no key '{key}'"):
            from_description({**keys, key: "mm"})


def test_preset_with_an_open_key_requires_it() -> None:
    with pytest.raises(ValueError, match="needs the key 'radius': write an array file with kind ="):
        SensorArray.from_file("kraken-5")
    in_cm = from_description({"kind": "kraken-5", "radius": 35, "unit": "cm"})
    np.testing.assert_allclose(in_cm.positions, preset("kraken-5").positions)


def test_unknown_preset_is_refused_with_similar_names() -> None:
    with pytest.raises(
        ValueError, match=r"file or a preset; got 'respeaker4mic': did you mean respeaker-4"
    ):
        SensorArray.from_file("respeaker4mic")


def test_swellex96_files_of_21_and_64_channels_have_the_same_sensors() -> None:
    few, many = preset("swellex96-vla-21").positions, preset("swellex96-vla").positions
    assert few[0] > few[-1]
    assert many[0] < many[-1]
    nearest = np.abs(few - many[:, 0]).min(axis=1)
    assert nearest.max() < 0.02  # rounded in the published table
    steps = np.diff(few[:, 0]) / -1.875
    assert np.rint(steps).tolist() == [3] * 6 + [6] + [3] * 13  # the defective element is left out
    assert 133.5 not in -many
