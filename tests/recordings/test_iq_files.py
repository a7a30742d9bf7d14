"""Raw complex samples, and SigMF recordings."""

import json
import tarfile
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from arrivals.recordings import read
from arrivals.recordings.formats.file_contents import ReadingOptions
from arrivals.recordings.formats.iq import RAW_TYPES, SUFFIXES, read_iq
from arrivals.recordings.formats.sigmf import read_sigmf
from arrivals.typing import Complex

RNG = np.random.default_rng(0)
Y: Complex = RNG.uniform(-0.7, 0.7, (60, 3)) + 1j * RNG.uniform(-0.7, 0.7, (60, 3))


def options(form: str | None) -> ReadingOptions:
    return ReadingOptions(format=form, n_channels=3)


def raw(y: Complex, name: str) -> bytes:
    """Return samples as interleaved pairs of a type, by the definition of each."""
    parts = np.stack([y.real, y.imag], axis=-1)
    if name in ("cf32", "cf64"):
        return parts.astype("<f4" if name == "cf32" else "<f8").tobytes()
    if name == "cu8":
        return np.round(parts * 127.5 + 127.5).astype("u1").tobytes()
    bits = int(name[2:])
    return np.round(parts * 2.0 ** (bits - 1)).astype(f"<i{bits // 8}").tobytes()


@pytest.mark.parametrize("name", RAW_TYPES)
def test_raw_samples_are_those_written(tmp_path: Path, name: str) -> None:
    step = {"cf32": 1e-7, "cf64": 1e-15}.get(name, 2.0 ** -int(name[2:]))
    suffixes = [suffix for suffix, kind in SUFFIXES.items() if kind == name] + [".bin"]
    for suffix in suffixes:
        path = tmp_path / f"a{suffix}"
        path.write_bytes(raw(Y, name))
        array = read_iq(path, options(name if suffix == ".bin" else None)).array
        assert array.shape == (60, 3)
        assert_allclose(array[:], Y, atol=np.sqrt(2) * max(step, 1e-7))
        assert_array_equal(array[7:20], array[:][7:20])


def test_format_replaces_the_suffix(tmp_path: Path) -> None:
    (tmp_path / "a.cf32").write_bytes(raw(Y, "cs16"))
    assert_allclose(read_iq(tmp_path / "a.cf32", options("cs16")).array[:], Y, atol=1e-4)


@pytest.mark.parametrize(
    ("name", "content", "changes", "message"),
    [
        ("a.iq", raw(Y, "cf32"), {}, r"type .* is unknown: pass format= \(--format\), one of cf32"),
        ("a.cf32", raw(Y, "cf32")[:-4], {}, "not cf32 of 3 channels: .* remove the last 20 bytes"),
        ("a.cf32", raw(Y, "cf32"), {"n_channels": 7}, "not cf32 of 7 channels"),
        ("a.cf32", b"", {}, "truncated"),
        ("a.cf32", raw(Y, "cs16"), {}, r"not cf32: .* \(--format cs16\)"),
        ("a.cf32", raw(Y, "cs8") * 4, {}, "not cf32"),
    ],
)
def test_raw_samples_that_do_not_fit_are_refused(
    tmp_path: Path, name: str, content: bytes, changes: dict[str, Any], message: str
) -> None:
    # a whole number of frames, so that the numbers decide
    content = content[:-24] if "not cf32:" in message and len(content) % 24 else content
    (tmp_path / name).write_bytes(content)
    with pytest.raises(ValueError, match=message):
        read_iq(tmp_path / name, ReadingOptions(**{"n_channels": 3} | changes))


# SigMF


def sigmf(folder: Path, y: Complex = Y, datatype: str = "cf32_le", **changes: Any) -> Path:
    """Write a SigMF recording; return the path of its metadata."""
    name = {"cf32_le": "cf32", "ci16_le": "cs16", "cu8": "cu8"}.get(datatype, "cf32")
    (folder / "a.sigmf-data").write_bytes(raw(y, name))
    fields = {
        "core:datatype": datatype, "core:sample_rate": 240e3, "core:num_channels": 3,
        "core:version": "1.0.0",
    } | changes.pop("fields", {})  # fmt: skip
    captures = [{"core:sample_start": 0, "core:frequency": 433.92e6}]
    meta = {"global": fields, "captures": captures, "annotations": []} | changes
    (folder / "a.sigmf-meta").write_text(json.dumps(meta))
    return folder / "a.sigmf-meta"


@pytest.mark.parametrize(
    ("datatype", "step"), [("cf32_le", 1e-7), ("ci16_le", 1e-4), ("cu8", 0.02)]
)
def test_sigmf_recording_has_samples_rate_and_frequency(
    tmp_path: Path, datatype: str, step: float
) -> None:
    meta = sigmf(tmp_path, datatype=datatype)
    for path in (meta, meta.with_suffix(".sigmf-data")):
        contents = read_sigmf(path, ReadingOptions())
        assert (contents.rate, contents.frequency, contents.note) == (240e3, 433.92e6, None)
        assert_allclose(contents.array[:], Y, atol=step)
        assert_array_equal(contents.array[7:20], contents.array[:][7:20])


def test_sigmf_archive_is_read_in_place(tmp_path: Path) -> None:
    meta = sigmf(tmp_path)
    with tarfile.open(tmp_path / "b.sigmf", "w") as archive:
        for path in (meta, meta.with_suffix(".sigmf-data")):
            archive.add(path, f"a/{path.name}")
    contents = read_sigmf(tmp_path / "b.sigmf", ReadingOptions())
    assert (contents.rate, contents.frequency) == (240e3, 433.92e6)
    assert_array_equal(contents.array[7:20], Y[7:20].astype("c8"))


@pytest.mark.parametrize("name", ["f64_le", "f32_be", "i32_be", "i16_be", "i8", "u8"])
@pytest.mark.parametrize("kind", ["c", "r"])
def test_sigmf_types_are_decoded(tmp_path: Path, kind: str, name: str) -> None:
    bits, zero = int(name[1:].partition("_")[0]), 128 if name[0] == "u" else 0
    code = f"{'>' if name.endswith('_be') else '<'}{name[0]}{bits // 8}"
    parts = np.stack([Y.real, Y.imag], axis=-1).reshape(60, -1)
    stored = parts if name[0] == "f" else np.round(parts * 2.0 ** (bits - 1)) + zero
    fields = {"core:datatype": kind + name, "core:num_channels": 3 if kind == "c" else 6}
    meta = sigmf(tmp_path, fields=fields)
    meta.with_suffix(".sigmf-data").write_bytes(stored.astype(code).tobytes())
    step = 1e-6 if name[0] == "f" else 2.0 ** (1 - bits) + 1e-7
    samples = read_sigmf(meta, ReadingOptions()).array
    assert samples.dtype.kind == {"c": "c", "r": "f"}[kind]
    assert_allclose(samples[:], Y if kind == "c" else parts, atol=step)
    assert_array_equal(samples[7:20], samples[:][7:20])


def test_sigmf_real_samples_are_real(tmp_path: Path) -> None:
    meta = sigmf(tmp_path, fields={"core:datatype": "rf32_le", "core:num_channels": 2})
    array = read_sigmf(meta, ReadingOptions()).array
    assert (array.shape, array.dtype) == ((180, 2), np.dtype("f4"))
    assert_array_equal(array[:].reshape(-1, 3, 2)[..., 0], Y.real.astype("f4"))


def test_sigmf_several_captures_are_one_recording(tmp_path: Path) -> None:
    captures: list[dict[str, float]] = [
        {"core:sample_start": 0, "core:frequency": 1e8},
        {"core:sample_start": 30},
    ]
    notes = [{"core:sample_start": 3, "core:sample_count": 9}]
    contents = read_sigmf(sigmf(tmp_path, captures=captures, annotations=notes), ReadingOptions())
    assert contents.frequency == 1e8
    assert contents.note == "2 captures are read as one, without gaps; 1 annotation is ignored"
    captures[1]["core:frequency"] = 2e8
    contents = read_sigmf(sigmf(tmp_path, captures=captures), ReadingOptions())
    assert contents.frequency is None
    assert "their frequencies, 100000000, 200000000 Hz, differ: pass --center" in str(contents.note)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"fields": {"core:datatype": "complex64"}}, "datatype must be such as 'cf32_le'"),
        ({"fields": {"core:datatype": None}}, "datatype must be such as"),
        (
            {"fields": {"core:num_channels": 7}},
            r"1 samples of 7 channels, cf32_le \(56 bytes\); got 25.7",
        ),
        ({"fields": {"core:num_channels": 0}}, "num_channels must be"),
        ({"fields": {"core:sample_rate": -1}}, "sample_rate must be finite and positive"),
        (
            {"captures": [{"core:sample_start": 0, "core:header_bytes": 8}]},
            "header_bytes must be 0",
        ),
        ({"annotations": [{"core:sample_start": 99}]}, "expected at least 99 samples"),
        ({"global": []}, "not a SigMF recording"),
    ],
)
def test_sigmf_metadata_that_do_not_fit_are_refused(
    tmp_path: Path, changes: dict[str, Any], message: str
) -> None:
    with pytest.raises(ValueError, match=message):
        read_sigmf(sigmf(tmp_path, **changes), ReadingOptions())


def test_sigmf_half_a_recording_is_refused(tmp_path: Path) -> None:
    meta = sigmf(tmp_path)
    data = meta.with_suffix(".sigmf-data")
    content = data.read_bytes()
    for damaged in (b"", content[:-5]):
        data.write_bytes(damaged)
        with pytest.raises(ValueError, match="truncated"):
            read_sigmf(meta, ReadingOptions())
    data.unlink()
    with pytest.raises(ValueError, match=r"a\.sigmf-data is missing: put it beside the metadata"):
        read_sigmf(meta, ReadingOptions())
    data.write_bytes(content)
    meta.write_text("{")
    with pytest.raises(ValueError, match="not a SigMF recording"):
        read_sigmf(data, ReadingOptions())
    meta.unlink()
    with pytest.raises(ValueError, match=r"a\.sigmf-meta is missing: .* --format and --rate"):
        read_sigmf(data, ReadingOptions())
    (tmp_path / "b.sigmf").write_bytes(b"not a tar file")
    with pytest.raises(ValueError, match="not a SigMF recording"):
        read_sigmf(tmp_path / "b.sigmf", ReadingOptions())


@pytest.mark.parametrize("form", ["cs32", "cs16", "cs8", "cu8"])
def test_floats_are_not_read_as_integers(tmp_path: Path, form: str) -> None:
    path = tmp_path / "a.cf32"
    parts = np.random.default_rng(0).standard_normal(4000).astype("<f4")
    parts.tofile(path)
    with pytest.raises(ValueError, match=f"a.cf32: the samples are not {form} but cf32: pass"):
        read(path, format=form)
