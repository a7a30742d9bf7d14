"""Page and its server, without a browser."""

import http.client
import socket
import sys
from dataclasses import replace
from typing import Any
from urllib.parse import urlsplit

import numpy as np
import pytest
from live_steps import CIRCLE, LINE, MAP, SKY, directions, line_steps, map_steps, sky_step

from arrivals.live.page.live_page import LivePage
from arrivals.live.page.server import PageServer, allowed_origins, server_address
from arrivals.live.steps import LiveScene, LiveStep, StepHistory

COLUMNS = ("label", "doa_deg", "std_deg", "existence", "level_db")
bokeh = pytest.importorskip("bokeh")


class Opened:
    """A page in a document, and what is on it."""

    def __init__(self, scene: LiveScene, steps: list[LiveStep]) -> None:
        from bokeh.document import Document

        self.history, self.document = StepHistory(), Document()
        columns = steps[0].estimate.columns if steps else COLUMNS
        self.page = LivePage(self.history, scene, columns)
        self.show(*steps)
        self.page.attach(self.document)

    def show(self, *steps: LiveStep) -> None:
        for step in steps:
            self.history.append(step)

    def models(self, kind: str) -> list[Any]:
        return [model for model in self.document.models if type(model).__name__ == kind]

    def data(self, column: str, *others: str) -> list[Any]:
        """Return the values of a column, of data sources that have others, too."""
        names = {column, *others}
        sources = [m.data for m in self.models("ColumnDataSource") if names <= set(m.data)]
        assert sources
        return list(sources[0][column])

    def text(self) -> str:
        return " ".join(div.text for div in self.models("Div"))


def test_page_shows_the_steps_and_the_status() -> None:
    opened = Opened(LINE, line_steps())
    np.testing.assert_allclose(opened.data("doa_deg", "low"), [0, 10, 20, 30, 40])
    assert opened.data("image")[0].shape == (91, 5)
    assert opened.data("channel") == [1, 2]
    for words in ("tow.wav: svalse", "step 4", "a step every 10.0 ms", "lag 0.20 s", ">40.00<"):
        assert words in opened.text()


def test_page_fits_the_levels_of_all_channels() -> None:
    opened = Opened(LINE, line_steps())  # -10 dB and no power
    (plot,) = (plot for plot in opened.models("figure") if plot.xaxis.axis_label == "channel")
    assert (plot.x_range.start, plot.x_range.end) == (0.5, 2.5)
    assert (plot.y_range.start, plot.y_range.end) == (-60.0, 0.0)
    last = line_steps()[-1]
    opened.show(replace(last, channel_db=np.array([-93.0, -88.0])))
    opened.page.refresh()
    assert (plot.y_range.start, plot.y_range.end) == (-100.0, -80.0)


def test_page_before_the_first_step_waits() -> None:
    opened = Opened(CIRCLE, [])
    assert "waiting for the first step" in opened.text()
    opened.show(LiveStep(0, 0.5, directions([], [])))  # no source
    opened.page.refresh()
    assert "step 0" in opened.text()
    assert opened.data("doa_deg", "low") == []


def test_page_that_is_paused_stays_and_catches_up() -> None:
    steps = line_steps(5)
    opened = Opened(LINE, steps[:2])
    (pause,) = opened.models("Toggle")
    pause.active = True
    opened.show(*steps[2:])
    opened.page.refresh()
    assert (len(opened.data("doa_deg", "low")), pause.label) == (2, "Resume")
    pause.active = False
    opened.page.refresh()
    assert (len(opened.data("doa_deg", "low")), pause.label) == (5, "Pause")


def test_page_follows_time_unless_the_user_has_zoomed() -> None:
    steps = [LiveStep(k, 0.05 * k, directions(0.0, 1)) for k in range(802)]
    opened = Opened(LINE, steps[:800])
    (axis,) = (
        plot.x_range for plot in opened.models("figure") if plot.xaxis.axis_label == "time, s"
    )
    assert (axis.start, axis.end) == pytest.approx((9.95, 39.95))
    axis.start, axis.end = 20.0, 25.0
    opened.show(steps[800])
    opened.page.refresh()
    assert (axis.start, axis.end) == (20.0, 25.0)
    axis.start, axis.end = axis.reset_start, axis.reset_end
    opened.show(steps[801])
    opened.page.refresh()
    assert (axis.start, axis.end) == pytest.approx((10.05, 40.05))


def test_page_of_long_steps_shows_four_hundred() -> None:
    steps = [LiveStep(k, 10.0 * k, directions(0.0, 1)) for k in range(500)]
    opened = Opened(LINE, steps)
    (axis,) = (
        plot.x_range for plot in opened.models("figure") if plot.xaxis.axis_label == "time, s"
    )
    assert (axis.start, axis.end) == (1000.0, 4990.0)


def test_page_says_that_the_run_has_ended() -> None:
    opened = Opened(LINE, line_steps())
    opened.history.ended = True
    opened.page.refresh()
    assert "the run has ended" in opened.text()


def test_page_of_unknown_elevations_shows_the_sky() -> None:
    opened = Opened(SKY, [sky_step()])
    np.testing.assert_allclose(opened.data("y", "elevation_deg"), [2 / 3])


def test_page_of_positions_shows_the_map() -> None:
    opened = Opened(MAP, map_steps())
    assert opened.data("x_m", "y_m") == [5.0]
    lines = [m.data["xs"] for m in opened.models("ColumnDataSource") if "xs" in m.data]
    assert [[5.0, 5.0, 5.0]] in lines
    (ray,) = next(
        source.data["ys"] for source in opened.models("ColumnDataSource")
        if set(source.data) == {"xs", "ys"} and len(source.data["ys"]) == 1
    )  # fmt: skip
    assert ray == [0.0, pytest.approx(36.0)]  # four times the distance of the stations


def test_page_escapes_the_name_of_a_file() -> None:
    opened = Opened(LiveScene("<b>.wav: cbf"), [])
    assert "&lt;b&gt;.wav" in opened.text()


# server


@pytest.mark.parametrize("text", ["", "x", "70000", ":80", "localhost:", "1.5", "-1", "a.wav"])
def test_server_address_rejects_what_is_not_a_port(text: str) -> None:
    with pytest.raises(ValueError, match=r"--serve must be PORT or HOST:PORT; got"):
        server_address(text)


def test_server_address_takes_ipv6() -> None:
    assert server_address("[::1]:0") == ("::1", 0)
    assert allowed_origins("::1", 80) == ["[::1]:80", "localhost:80"]
    assert "[::1]:80" in allowed_origins("::", 80)


def test_origins_have_the_names_of_this_computer_in_small_letters(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(socket, "gethostname", lambda: "Lab")
    monkeypatch.setattr(socket, "getfqdn", lambda: "Lab.Example")
    assert allowed_origins("192.0.2.1", 80) == ["192.0.2.1:80", "lab:80", "lab.example:80"]


def test_server_ends_at_once_if_it_is_closed_as_soon_as_it_is_open() -> None:
    for _ in range(5):
        server = PageServer(StepHistory(), CIRCLE, COLUMNS, port=0)
        server.close()
        assert not server._thread.is_alive()


def test_origins_of_all_addresses_are_names_of_this_computer() -> None:
    origins = allowed_origins("0.0.0.0", 80)
    assert {"127.0.0.1:80", "localhost:80", f"{socket.gethostname().lower()}:80"} <= set(origins)
    assert "*" not in "".join(origins)


def handshake(url: str, origin: str) -> int:
    """Return the status with which a websocket of this origin is answered."""
    parts = urlsplit(url)
    connection = http.client.HTTPConnection(parts.hostname or "", parts.port, timeout=20)
    headers = {
        "Upgrade": "websocket", "Connection": "Upgrade", "Sec-WebSocket-Version": "13",
        "Sec-WebSocket-Key": "dGhlIHNhbXBsZSBub25jZQ==", "Origin": origin,
    }  # fmt: skip
    connection.request("GET", "/ws", headers=headers)
    with connection.getresponse() as response:
        status = response.status
    connection.close()
    return status


def test_server_is_on_the_loopback_and_refuses_foreign_origins(
    caplog: pytest.LogCaptureFixture,
) -> None:
    server = PageServer(StepHistory(), CIRCLE, COLUMNS, port=0)
    try:
        port = urlsplit(server.url).port
        assert server.url == f"http://127.0.0.1:{port}/"
        assert handshake(server.url, f"http://localhost:{port}") == 101
        assert handshake(server.url, "http://attacker.example") == 403
        assert handshake(server.url, f"http://attacker.example:{port}") == 403
        with pytest.raises(OSError):  # noqa: PT011  (its text is that of the system)
            PageServer(StepHistory(), CIRCLE, COLUMNS, port=port or 0)
    finally:
        server.close()
    with socket.socket() as free:
        free.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        free.bind(("127.0.0.1", port))


def test_server_without_bokeh_names_the_extra(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "bokeh.server.server", None)
    with pytest.raises(
        ImportError, match=r"the page requires bokeh: pip install \"arrivals\[live\]\""
    ):
        PageServer(StepHistory(), CIRCLE, COLUMNS, port=0)
