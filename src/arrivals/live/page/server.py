"""Server of the page of a run, in a thread of its own."""

from __future__ import annotations

import asyncio
import logging
import socket
import sys
import threading
from contextlib import suppress
from functools import partial
from typing import Any

from arrivals.live.page.live_page import LivePage
from arrivals.live.steps import LiveScene, StepHistory
from arrivals.messages import in_line

LOOPBACK = "127.0.0.1"
PORT = 5006
START_TIMEOUT = 30.0  # s: importing bokeh on a slow disk
EVERY = {"0.0.0.0": LOOPBACK, "::": "::1"}  # stand for all of the machine; one of each


def server_address(text: str) -> tuple[str, int]:
    """Return host and port of PORT or HOST:PORT.

    Parameters
    ----------
    text : str
        Such as "5006", "0.0.0.0:5006" or "[::1]:5006"; port 0 is a free one.

    Returns
    -------
    host : str
        The loopback address without one.
    port : int

    Raises
    ------
    ValueError
        If it is something else.

    Examples
    --------
    >>> server_address("5006"), server_address("0.0.0.0:80")
    (('127.0.0.1', 5006), ('0.0.0.0', 80))
    """
    host, colon, port = text.rpartition(":")
    valid = port.isascii() and port.isdigit() and len(port) <= 5 and int(port) < 2**16
    if not valid or (colon and not host):
        raise ValueError(
            f"--serve must be PORT or HOST:PORT; got {text!r}: write FILE before --serve"
        )
    return host.strip("[]") or LOOPBACK, int(port)


def allowed_origins(host: str, port: int) -> list[str]:
    """Return the origins from which a page may connect: names of the address that is served.

    Parameters
    ----------
    host : str
        Address that is bound.
    port : int
        Its port.

    Returns
    -------
    list of str
        HOST:PORT.

    Examples
    --------
    >>> allowed_origins("127.0.0.1", 5006)
    ['127.0.0.1:5006', 'localhost:5006']
    """
    names = [host]
    if host not in (LOOPBACK, "::1", "localhost"):
        own = socket.gethostname()
        names += [own, socket.getfqdn()]
    if host in EVERY:
        names = [LOOPBACK, "::1", *names[1:]]
        with suppress(OSError):
            names += [str(one[4][0]) for one in socket.getaddrinfo(own, None)]
    if host in (*EVERY, LOOPBACK, "::1"):
        names.append("localhost")
    bracketed = [f"[{name}]" if ":" in name else name.lower() for name in names]
    return [f"{name}:{port}" for name in dict.fromkeys(bracketed)]


class PageServer:
    """Server of pages on the history of a run; each browser has a page of its own.

    Parameters
    ----------
    history : StepHistory
        Steps of the run.
    scene : LiveScene
        The run.
    columns : tuple of str
        Columns of the tracks file.
    host : str
        Address that is bound.
    port : int
        Port; 0 for a free one.

    Attributes
    ----------
    url : str
        Address of the page.

    Raises
    ------
    ImportError
        If bokeh is not installed.
    OSError
        If the port is taken, or the address cannot be bound.
    """

    def __init__(
        self,
        history: StepHistory,
        scene: LiveScene,
        columns: tuple[str, ...],
        host: str = LOOPBACK,
        port: int = PORT,
    ) -> None:
        require_bokeh()
        self.url = ""
        self._make = partial(LivePage, history, scene, columns)
        self._address = host, port
        self._started = threading.Event()
        self._error: Exception | None = None
        self._loop: asyncio.AbstractEventLoop | None = None
        self._thread = threading.Thread(target=self._serve, name="page", daemon=True)
        self._thread.start()
        if not self._started.wait(START_TIMEOUT):
            raise OSError(f"the server of the page did not start within {START_TIMEOUT:g} s")
        if self._error is not None:
            raise self._error

    def close(self) -> None:
        """End the server; open pages keep what they show."""
        loop = self._loop
        if loop is not None and not loop.is_closed():
            with suppress(RuntimeError):  # closed since
                loop.call_soon_threadsafe(loop.stop)
        self._thread.join(5.0)

    def _serve(self) -> None:
        loop = asyncio.new_event_loop()
        asyncio.set_event_loop(loop)
        try:
            server = self._bound()
        except Exception as error:
            self._error = error
            loop.close()
            self._started.set()
            return
        self._loop = loop
        self._started.set()
        try:
            server.start()
            loop.run_forever()
        finally:
            server.stop(wait=False)
            loop.run_until_complete(asyncio.sleep(0.05))  # closes the sockets
            loop.close()

    def _bound(self) -> Any:
        """Return a server whose socket is bound."""
        from bokeh.application import Application
        from bokeh.application.handlers import FunctionHandler
        from bokeh.server.server import Server

        # requests of missing icons and the like are no news of the run
        for name in ("tornado.access", "bokeh.server.views.ws", "bokeh.server.server"):
            logging.getLogger(name).setLevel(logging.ERROR)
        application = Application(FunctionHandler(lambda document: self._make().attach(document)))
        host, port = self._address
        port = checked_port(host, port)
        server = Server(
            {"/": application}, address=host, port=port, num_procs=1,
            allow_websocket_origin=allowed_origins(host, port),
        )  # fmt: skip
        shown = EVERY.get(host, host)
        self.url = f"http://[{shown}]:{port}/" if ":" in shown else f"http://{shown}:{port}/"
        return server


def checked_port(host: str, port: int) -> int:
    """Return a port of an address that can be bound now.

    Parameters
    ----------
    host : str
        The address.
    port : int
        The port, or 0 for any that is free.

    Returns
    -------
    int

    Raises
    ------
    OSError
        If the port is taken, or the address does not exist.
    """
    family, kind, protocol, _, address = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM)[0]
    with socket.socket(family, kind, protocol) as probe:
        if sys.platform != "win32":  # there it would allow a port that is taken
            probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        probe.bind(address)
        return int(probe.getsockname()[1])


def require_bokeh() -> None:
    """Raise an ImportError with the command that installs bokeh, if it cannot be imported."""
    try:
        import bokeh.server.server  # noqa: F401
    except ImportError as error:
        raise ImportError(
            f'the page requires bokeh: pip install "arrivals[live]" ({in_line(error)})'
        ) from error
