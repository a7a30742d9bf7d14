"""Page of a live stream in a real browser: Debian's chromium, without a window."""

import os
import shutil
import signal
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from command_line import RATE, SHELL, WINDOW, pressure, run_cli, table, track

FLAGS = [
    "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run",
    "--disable-background-networking", "--disable-component-update", "--disable-sync",
]  # fmt: skip
# times and directions that the page has, in s and degrees; the status of the run
DIRECTIONS = """() => {
    for (const model of Bokeh.documents[0].all_models)
        if (model.type == "ColumnDataSource" && "low" in model.data)
            return [Array.from(model.data.time), Array.from(model.data.doa_deg)]
}"""
TEXT = """() => Array.from(Bokeh.documents[0].all_models)
    .filter(model => model.type == "Div").map(model => model.text).join(" ")"""
SHOWN = 60_000  # ms in which something must have been shown, on a busy computer
DOA = np.linspace(-60.0, 60.0, 120)  # degrees, one per window
MIDDLES = np.arange(len(DOA)) + 0.5
HALF = len(DOA) // 2 * WINDOW * 16  # bytes


@pytest.fixture(scope="module")
def chromium() -> str:
    """Return the browser; without one, skip the test, or fail where it is required."""
    program = shutil.which("chromium")
    if program is None or not _has_packages():
        words = "chromium and playwright are required"
        if os.environ.get("ARRIVALS_REQUIRE_BROWSER") == "1":
            pytest.fail(words)
        pytest.skip(words)
    return program


def _has_packages() -> bool:
    try:
        import bokeh  # noqa: F401
        import playwright.sync_api  # noqa: F401
    except ImportError:
        return False
    return True


@pytest.fixture(scope="module")
def raw() -> bytes:
    """Return samples of a source that moves from -60 to 60 degrees."""
    at = np.arange(len(DOA) * WINDOW) / WINDOW - 0.5
    samples = pressure(np.interp(at, np.arange(len(DOA)), DOA))
    content: bytes = np.rint(samples * 32768).astype("<i2").tobytes()
    return content


@pytest.fixture
def live(scene: Path, here: Path) -> Iterator[subprocess.Popen[bytes]]:
    """Start a live tracker with a page."""
    arguments = track(scene, "--rate", str(RATE), "--serve", "0", "--out", "live.csv", file="-")
    pipes: dict[str, Any] = {"stdin": subprocess.PIPE, "stderr": subprocess.PIPE}
    with subprocess.Popen([*SHELL, *arguments], **pipes) as process:
        yield process
        process.kill()


@pytest.mark.skipif(sys.platform == "win32", reason="interrupts are sent as POSIX does")
def test_page_shows_moving_tracks_and_its_end_changes_nothing(
    chromium: str, scene: Path, here: Path, live: subprocess.Popen[bytes], raw: bytes
) -> None:
    from playwright.sync_api import sync_playwright

    assert live.stdin is not None
    assert live.stderr is not None
    live.stdin.write(raw[:HALF])
    live.stdin.flush()
    url = live.stderr.readline().decode().removeprefix("arrivals: page: ").strip()
    complaints, addresses = list[str](), list[str]()
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=chromium, args=FLAGS)
        page = browser.new_page(viewport={"width": 1280, "height": 860})
        page.on("pageerror", lambda error: complaints.append(str(error)))
        page.on("console", lambda message: complaints.extend(
            [message.text] if message.type in ("error", "warning") else []))  # fmt: skip
        page.on("request", lambda request: addresses.append(request.url))
        page.goto(url, timeout=SHOWN)
        page.wait_for_function("() => window.Bokeh && Bokeh.documents.length", timeout=SHOWN)
        page.wait_for_function(f"() => ({DIRECTIONS})()[0].length >= 55", timeout=SHOWN)
        first = page.evaluate(DIRECTIONS)
        live.stdin.write(raw[HALF : HALF + HALF // 2])
        live.stdin.flush()
        page.wait_for_function(f"() => ({DIRECTIONS})()[0].length >= 85", timeout=SHOWN)
        second = page.evaluate(DIRECTIONS)
        for time, doa in (first, second):
            np.testing.assert_allclose(doa, np.interp(time, WINDOW / RATE * MIDDLES, DOA), atol=3.0)
        assert second[1][-1] - first[1][-1] > 20.0
        assert "step 8" in page.evaluate(TEXT)
        picture = page.screenshot(path=here / "page.png")
        assert len(picture) > 20_000  # an empty page has 4 kB

        page.get_by_role("button", name="Pause").click()
        page.get_by_role("button", name="Resume").wait_for(timeout=SHOWN)
        live.stdin.write(raw[HALF + HALF // 2 : HALF + 3 * HALF // 4])
        live.stdin.flush()
        page.get_by_role("button", name="Resume").click()
        page.wait_for_function(f"() => ({DIRECTIONS})()[0].length >= 100", timeout=SHOWN)
        page.close()
        browser.close()
    assert complaints == []
    assert {address.split("/")[2] for address in addresses if "://" in address} == {url[7:-1]}

    live.stdin.write(raw[HALF + 3 * HALF // 4 :])
    live.stdin.close()
    assert b"the run has ended" in live.stderr.readline()
    live.send_signal(signal.SIGINT)
    assert live.wait(30) == 0
    alone = run_cli(track(scene, "--rate", str(RATE), "--out", "alone.csv", file="-"), input=raw)
    assert alone.returncode == 0
    assert (here / "live.csv").read_text() == (here / "alone.csv").read_text()
    assert len(table((here / "live.csv").read_text())) >= 115
