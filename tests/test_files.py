"""Outputs that replace regular files only, and inputs that are regular files."""

import os
import stat
import sys
import threading
from pathlib import Path

import pytest

from arrivals import files
from arrivals.cli.outputs import same_file
from arrivals.files import atomic_write, check_output, open_input, open_live

posix = pytest.mark.skipif(sys.platform == "win32", reason="pipes, links and modes are POSIX's")


def write(path: Path, text: str = "new") -> None:
    with atomic_write(path) as file:
        file.write(text)


def mode(path: Path) -> int:
    return stat.S_IMODE(path.stat().st_mode)


def received(pipe: Path) -> tuple[threading.Thread, list[bytes]]:
    """Start a thread that reads a pipe to its end."""
    contents: list[bytes] = []
    thread = threading.Thread(target=lambda: contents.append(pipe.read_bytes()))
    thread.start()
    return thread, contents


@posix
def test_pipe_receives_the_contents_and_stays_a_pipe(tmp_path: Path) -> None:
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    thread, contents = received(pipe)
    with atomic_write(pipe, binary=True) as file:
        file.write(b"later")
        file.seek(0)  # as writers of WAV do
        file.write(b"first")
    thread.join(timeout=10)
    assert contents == [b"first"]
    assert stat.S_ISFIFO(pipe.stat().st_mode)
    assert os.listdir(tmp_path) == ["pipe"]


@posix
def test_pipe_without_a_reader_is_an_error_with_its_name(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(files, "WAIT_FOR_READER", 0.05)
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    with pytest.raises(OSError, match=r"no process reads this pipe: .*/pipe"):
        write(pipe)
    assert stat.S_ISFIFO(pipe.stat().st_mode)


@posix
@pytest.mark.skipif(not hasattr(os, "geteuid") or os.geteuid() != 0, reason="makes a device")
def test_device_is_written_through(tmp_path: Path) -> None:
    null, full = tmp_path / "null", tmp_path / "full"
    try:
        os.mknod(null, 0o666 | stat.S_IFCHR, os.makedev(1, 3))
        os.mknod(full, 0o666 | stat.S_IFCHR, os.makedev(1, 7))
        null.write_text("")
    except OSError:
        pytest.skip("this machine makes no devices here")
    write(null)
    with open_live(null) as file:
        file.write(b"new")
    with pytest.raises(OSError, match=r"No space left on device: .*/full"):
        write(full)
    assert all(stat.S_ISCHR(path.stat().st_mode) for path in (null, full))
    assert sorted(os.listdir(tmp_path)) == ["full", "null"]


@posix
def test_link_to_an_open_file_of_the_process_is_written_through(tmp_path: Path) -> None:
    (tmp_path / "log").write_text("old, ")
    with open(tmp_path / "log", "a") as log:
        (tmp_path / "out.csv").symlink_to(f"/proc/self/fd/{log.fileno()}")
        inode = (tmp_path / "log").stat().st_ino
        write(tmp_path / "out.csv")
    assert (tmp_path / "log").read_text() == "old, new"
    assert (tmp_path / "log").stat().st_ino == inode


@posix
@pytest.mark.parametrize("exists", [True, False])
def test_links_are_followed_and_stay(tmp_path: Path, exists: bool) -> None:
    (tmp_path / "data").mkdir()
    target = tmp_path / "data" / "target.csv"
    if exists:
        target.write_text("old")
    (tmp_path / "inner").symlink_to("data/target.csv")
    (tmp_path / "outer").symlink_to("inner")
    write(tmp_path / "outer")
    assert target.read_text() == "new"
    assert (tmp_path / "outer").is_symlink()
    assert os.listdir(tmp_path / "data") == ["target.csv"]


@posix
def test_link_to_itself_is_an_error_with_its_name(tmp_path: Path) -> None:
    (tmp_path / "loop").symlink_to("loop")
    for use in (write, check_output, open_input):
        with pytest.raises(OSError, match=r"symbolic links.*: .*/loop"):
            use(tmp_path / "loop")


@posix
def test_mode_of_an_old_file_is_kept_and_a_new_one_has_that_of_the_process(tmp_path: Path) -> None:
    old, new, plain = tmp_path / "old", tmp_path / "new", tmp_path / "plain"
    old.touch()
    plain.touch()
    old.chmod(0o640)
    with atomic_write(old) as file:
        (part,) = tmp_path.glob(".old.*.part")
        assert mode(part) == 0o640  # not readable by others for a while
        file.write("new")
    write(new)
    assert (mode(old), mode(new)) == (0o640, mode(plain))


@posix
def test_parts_of_dead_processes_of_this_target_only_are_removed(tmp_path: Path) -> None:
    dead, parent = 2**22 + 1, os.getppid()  # above the largest number of a process
    names = [f".t.csv.{dead}.part", f".t.csv.{dead}-1.part"]
    others = [f".u.csv.{dead}.part", f".t.csv.{parent}.part", ".t.csv.old.part", f".t.{dead}.part"]
    for name in names + others:
        (tmp_path / name).touch()
    write(tmp_path / "t.csv")
    assert sorted(os.listdir(tmp_path)) == sorted([*others, "t.csv"])


def test_two_writers_of_one_file_do_not_mix(tmp_path: Path) -> None:
    path = tmp_path / "a"
    with atomic_write(path) as first, atomic_write(path) as second:
        first.write("first")
        second.write("second")
    assert path.read_text() == "first"
    assert os.listdir(tmp_path) == ["a"]


@pytest.mark.parametrize("name", ["x" * 255, "ä" * 100 + ".csv", "two\nlines", "🎧.csv", "a[1]*"])
def test_unusual_names_are_written_and_read(tmp_path: Path, name: str) -> None:
    write(tmp_path / name)
    with open_input(tmp_path / name) as file:
        assert file.read() == b"new"
    assert os.listdir(tmp_path) == [name]


def test_name_that_is_too_long_is_refused_before_the_work(tmp_path: Path) -> None:
    with pytest.raises(OSError, match="too long"):
        check_output(tmp_path / ("x" * 300))
    assert os.listdir(tmp_path) == []


def test_error_within_keeps_the_old_file_and_names_it(tmp_path: Path) -> None:
    path = tmp_path / "a"
    path.write_text("old")

    def fill() -> None:
        with atomic_write(path) as file:
            file.write("new")
            raise OSError(28, "No space left on device")

    with pytest.raises(OSError, match=r"No space left on device: .*/a'"):
        fill()
    assert path.read_text() == "old"
    assert os.listdir(tmp_path) == ["a"]


def test_input_must_be_a_regular_file(tmp_path: Path) -> None:
    with pytest.raises(IsADirectoryError, match="not a regular file"):
        open_input(tmp_path)
    if sys.platform != "win32":
        os.mkfifo(tmp_path / "pipe")
        with pytest.raises(OSError, match=r"not a regular file: .*/pipe"):
            open_input(tmp_path / "pipe")


@posix
def test_same_file_by_links_and_hard_links(tmp_path: Path) -> None:
    (tmp_path / "a").touch()
    (tmp_path / "b").symlink_to("a")
    os.link(tmp_path / "a", tmp_path / "c")
    assert same_file(tmp_path / "a", tmp_path / "b")
    assert same_file(tmp_path / "a", tmp_path / "c")
    assert not same_file(tmp_path / "a", tmp_path / "d")
