"""Results files of studies: resumed, locked, damaged and full."""

import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
import small_studies
from small_studies import numbers, reference, small

import arrivals
from arrivals.scenarios import Method, Study, monte_carlo
from arrivals.scenarios.experiments import results_file
from arrivals.scenarios.experiments.batch import Row
from arrivals.scenarios.experiments.results_file import Results, read_rows

PATHS = [str(Path(small_studies.__file__).parent), *sys.path]
ENVIRONMENT = os.environ | {"PYTHONPATH": os.pathsep.join(PATHS)}


def test_interrupted_study_resumes(tmp_path: Path) -> None:
    first = small(3, out=tmp_path)
    assert first.path is not None
    text = first.path.read_text()
    cut = "".join(text.splitlines(keepends=True)[:-5])[:-9]  # in the middle of a line
    first.path.write_text(cut)
    before = [row for row in read_rows(first.path) if row.run < 2]
    study = small(out=tmp_path)
    assert study.path == first.path
    assert numbers(study) == reference()
    kept = [row for row in study.rows() if row.run < 2]
    assert {row for row in kept if row.metric == "cpu_ms"} >= {
        row for row in before if row.metric == "cpu_ms" and row.case == "fig6" and row.run < 2
    }  # not computed again: their times are the old ones


def test_finished_study_is_not_recomputed(tmp_path: Path) -> None:
    path = small(2, out=tmp_path).path
    assert path is not None
    before = path.read_bytes()
    assert small(1, out=tmp_path).runs == [0]
    assert small(2, out=tmp_path).runs == [0, 1]
    assert path.read_bytes() == before


def test_killed_study_resumes(tmp_path: Path) -> None:
    script = (
        "import os; import small_studies as t\n"
        "from arrivals.scenarios.experiments.batch import RunBatch\n"
        "rows = RunBatch.rows; n = []\n"
        "def exit_in_third(batch):\n"
        "    n.append(1); os._exit(9) if len(n) == 3 else None; return rows(batch)\n"
        f"RunBatch.rows = exit_in_third; t.small(out={str(tmp_path)!r})"
    )
    done = subprocess.run([sys.executable, "-c", script], env=ENVIRONMENT, check=False)
    assert done.returncode == 9
    (path,) = tmp_path.glob("study-*.csv")
    assert {row.run for row in Study.read(path).rows()} == {0, 1}
    assert numbers(small(out=tmp_path)) == reference()


def test_changed_configuration_has_its_own_file(tmp_path: Path) -> None:
    a = monte_carlo("svalse_fig6", ["cbf"], 1, seed=0, metrics=["gospa"], out=tmp_path)
    b = monte_carlo("svalse_fig6", ["cbf"], 1, seed=1, metrics=["gospa"], out=tmp_path)
    strict = Method("cbf", {"threshold_db": 3.0})
    c = monte_carlo("svalse_fig6", [strict], 1, metrics=["gospa"], out=tmp_path)
    assert len({a.path, b.path, c.path}) == 3
    with pytest.raises(ValueError, match=r"must be the file of this study; got another seed: "):
        monte_carlo("svalse_fig6", ["cbf"], 1, seed=1, metrics=["gospa"], out=a.path)
    assert len(Study.read(str(a.path)).rows()) == 2


def test_study_of_another_version_of_the_same_code_resumes(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(arrivals, "__version__", "0.0.1")
    path = small(2, out=tmp_path).path
    assert path is not None
    before = path.read_bytes()
    assert b'"version": "0.0.1"' in before
    monkeypatch.undo()
    study = small(out=tmp_path)  # one run more, checksums of the same first line
    assert study.path == path
    assert path.read_bytes().startswith(before)
    assert numbers(study) == reference()


def test_code_mark_has_modules_that_all_share(monkeypatch: pytest.MonkeyPatch) -> None:
    read, opened = Path.read_bytes, list[Path]()

    def read_and_note(path: Path) -> bytes:
        opened.append(path)
        return read(path)

    monkeypatch.setattr(Path, "read_bytes", read_and_note)
    results_file.code_mark([])
    assert {"symmetric.py", "svalse.py", "measurements.py"} <= {path.name for path in opened}
    assert Path(arrivals.__file__) not in opened  # the version counts for nothing


def test_changed_code_has_its_own_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    small(1, out=tmp_path)
    module = sys.modules["arrivals.scenarios.experiments.monte_carlo"]  # the function has its name
    monkeypatch.setattr(module, "code_mark", lambda modules: "other")
    small(1, out=tmp_path)
    assert len(list(tmp_path.iterdir())) == 2


def test_file_of_another_kind_is_rejected_and_kept(tmp_path: Path) -> None:
    notes = tmp_path / "notes.csv"
    notes.write_text("a,b\n1,2\n")
    with pytest.raises(ValueError, match=r"notes\.csv is not a study file"):
        monte_carlo("svalse_fig6", ["cbf"], 1, out=notes)
    assert notes.read_text() == "a,b\n1,2\n"
    with pytest.raises(FileNotFoundError, match="the folder does not exist"):
        monte_carlo("svalse_fig6", ["cbf"], 1, out=tmp_path / "no" / "study.csv")


@pytest.mark.skipif(sys.platform == "win32", reason="limits of file size are POSIX's")
def test_full_disk_is_reported_and_study_resumes(tmp_path: Path) -> None:
    script = (
        "import resource, signal, small_studies as t\n"
        "signal.signal(signal.SIGXFSZ, signal.SIG_IGN)\n"
        "resource.setrlimit(resource.RLIMIT_FSIZE, (6000, 6000))\n"
        f"t.small(out={str(tmp_path)!r})"
    )
    done = subprocess.run(
        [sys.executable, "-B", "-c", script], env=ENVIRONMENT, capture_output=True, text=True,
        check=False,
    )  # fmt: skip
    assert done.returncode == 1
    assert "finished runs are kept; call again to resume" in done.stderr
    (path,) = tmp_path.glob("study-*.csv")
    assert {row.run for row in read_rows(path)} >= {0, 1}
    assert numbers(small(out=tmp_path)) == reference()


def without_checksums(text: str) -> str:
    """Return a study file as it was before rows had checksums."""
    first, *rows = text.splitlines()
    return "\n".join([first, *(row.rpartition(",")[0] for row in rows), ""])


def test_file_without_checksums_is_read_and_resumed_with_them(tmp_path: Path) -> None:
    path = tmp_path / "study.csv"
    small(2, out=path)
    new = path.read_text()
    path.write_text(without_checksums(new))
    assert numbers(Study.read(path)) == [row for row in reference() if row[1] < 2]
    assert path.read_text() == without_checksums(new)
    small(2, out=path)
    assert path.read_text() == new


def test_changed_first_line_is_seen_by_every_reader(tmp_path: Path) -> None:
    path = tmp_path / "study.csv"
    small(1, out=path)
    path.write_text(path.read_text().replace('"seed": 3', '"seed": 1', 1))
    with pytest.raises(ValueError, match=r"line 3 of .* checksum, it or line 1 was changed"):
        Study.read(path)


def test_every_changed_digit_of_a_row_is_seen(tmp_path: Path) -> None:
    row = Row("case", 12, "cbf", "rmse", 0.25, "a note,\n'quoted' \"twice\"")
    results = Results({"scenarios": {"case": {}}, "methods": []}, tmp_path / "study.csv")
    results.add([row, row])
    path = tmp_path / "study.csv"
    assert list(read_rows(path)) == [row, row]
    whole = path.read_bytes()
    for place in range(whole.index(b"check\n") + 6, len(whole) - 1):
        path.write_bytes(whole[:place] + bytes([whole[place] ^ 1]) + whole[place + 1 :])
        with pytest.raises(ValueError, match=r"line \d of .*study\.csv"):
            list(read_rows(path))


def test_study_file_must_be_a_regular_file(tmp_path: Path) -> None:
    with pytest.raises(OSError, match="not a regular file"):
        Study.read(tmp_path)


@pytest.mark.parametrize(
    ("damage", "message"),
    [
        (lambda text: text[:40], "is not a study file"),  # cut off in its first line
        (lambda text: "", "is not a study file"),
        (lambda text: text.replace(",1,", ",one,", 1), r"line \d+ of .* is not a row of a study"),
        (lambda text: text + "\x00\xff,\n", r"line \d+ of .* is not a row of a study"),
        (
            lambda text: without_checksums(text).replace("fig6,0", "fig66,0"),
            "must be those of its first line; got 'fig66'",
        ),
        (lambda text: text.replace("fig6,0", "fig66,0"), r"line 3 of .* agree with its checksum"),
        (lambda text: text.replace(",gospa,", ",gospa,1", 1), r"line \d+ of .* with its checksum"),
        (lambda text: text + text.splitlines()[-1][:-1] + "z\n", "with its checksum, it or line 1"),
        (lambda text: text.replace('"seed": 3', '"seed": 1', 1), "got another seed"),
        (lambda text: "# arrivals study " + "[" * 10**5 + text, "is not a study file"),
        (lambda text: "# arrivals study []\n" + text, "is not a study file"),
    ],
)
def test_damaged_file_is_rejected_and_kept(
    tmp_path: Path, damage: Callable[[str], str], message: str
) -> None:
    path = tmp_path / "study.csv"
    small(2, out=path)
    path.write_text(damage(path.read_text()), encoding="latin-1")
    before = path.read_bytes()
    with pytest.raises(ValueError, match=message):
        small(3, out=path)
    assert path.read_bytes() == before


def test_full_disk_at_first_row_leaves_no_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(*arguments: Any, **options: Any) -> Any:
        file = open(*arguments, **options)  # noqa: SIM115  (given back)
        file.write(b"# arrivals st")
        file.close()
        raise OSError(28, "No space left on device")

    with monkeypatch.context() as patch:
        patch.setattr(results_file, "open", full, raising=False)
        with pytest.raises(OSError, match=r"No space left .* kept; call again"):
            Results({}, tmp_path / "study.csv").add([Row("a", 0, "b", "c", 1.0)])
    assert not (tmp_path / "study.csv").exists()
    assert numbers(small(out=tmp_path / "study.csv")) == reference()


def test_second_writer_of_a_file_is_rejected(tmp_path: Path) -> None:
    study = monte_carlo("svalse_fig6", ["cbf"], 1, metrics=["gospa"], out=tmp_path)
    results = Results(study.config, study.path)
    with results.writing(), pytest.raises(OSError, match="another process is writing"):
        monte_carlo("svalse_fig6", ["cbf"], 2, metrics=["gospa"], out=tmp_path)
    monte_carlo("svalse_fig6", ["cbf"], 2, metrics=["gospa"], out=tmp_path)
