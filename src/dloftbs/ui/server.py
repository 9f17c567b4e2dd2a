"""The server: the files of the page, and a WebSocket for each browser."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Awaitable, Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from importlib import resources
from threading import Event, Thread
from typing import Protocol

from aiohttp import WSMsgType, web

from dloftbs.errors import DloftbsError, InputError, SourceError
from dloftbs.ui.messages import MAX_BYTES, Ack, TuneMessage, ViewMessage, read
from dloftbs.ui.security import LOCAL, Access, security_headers
from dloftbs.ui.viewer import Viewer
from dloftbs.ui.wire import encode_text

PORT = 8765
"""Port that is tried first; another free one is taken where it is in use and was not asked for."""
_HEARTBEAT_S = 20.0  # after which a browser that has gone without a word is noticed
_CLOSING_S = 1.0
_TYPES = {".html": "text/html", ".js": "text/javascript", ".css": "text/css", ".svg": "image/svg+xml"}
Handler = Callable[[web.Request], Awaitable[web.StreamResponse]]
_log = logging.getLogger("dloftbs.ui")


class Session(Protocol):
    """Content of a page, one for all browsers. Its methods but `close` are called in the server's event loop."""

    def open(self, loop: asyncio.AbstractEventLoop) -> None:
        """Begin; `loop` is where viewers are told of news."""

    def join(self, viewer: Viewer) -> None:
        """Take a browser in, and tell it how things stand."""

    def leave(self, viewer: Viewer) -> None:
        """Forget a browser."""

    def handle(self, viewer: Viewer, message: TuneMessage | ViewMessage) -> None:
        """Do what a message asks.

        Raises
        ------
        DloftbsError
            If that cannot be; the browser is told why.
        """

    async def render(self, viewer: Viewer) -> tuple[int, bytes] | None:
        """Make the picture that a browser is to show now."""

    def close(self) -> None:
        """End."""


@dataclass(frozen=True)
class Address:
    """Address under which a server listens."""

    host: str
    port: int
    token: str

    @property
    def url(self) -> str:
        """The address that a browser opens."""
        return f"http://{self.authority}/{self.token}/"

    @property
    def authority(self) -> str:
        """Host and port."""
        host = LOCAL if self.host in ("0.0.0.0", "::") else self.host
        return f"[{host}]:{self.port}" if ":" in host else f"{host}:{self.port}"


def page_files() -> dict[str, tuple[str, bytes]]:
    """Return the type and the content of each file of the page, by name: no others can be asked for."""
    folder = resources.files("dloftbs.ui").joinpath("page")
    found = {}
    for file in folder.iterdir():
        suffix = file.name[file.name.rfind(".") :]
        if suffix in _TYPES:
            found[file.name] = (_TYPES[suffix], file.read_bytes())
    return found


def make_app(session: Session, access: Access) -> web.Application:
    """Return the application that serves a session."""
    files = page_files()
    sockets: set[web.WebSocketResponse] = set()

    @web.middleware
    async def guard(request: web.Request, handler: Handler) -> web.StreamResponse:
        token = request.match_info.get("token", "")
        why = access.refusal(token, request.headers.get("Host"), request.headers.get("Origin"))
        if why is not None:
            return web.Response(status=403, text=f"{why}\n", headers=security_headers("localhost"))
        return await handler(request)

    async def page(request: web.Request) -> web.Response:
        kind, data = files.get(request.match_info["name"] or "index.html", (None, b""))
        headers = security_headers(request.headers["Host"])
        if kind is None:
            return web.Response(status=404, text="there is no such file\n", headers=headers)
        return web.Response(body=data, content_type=kind, charset="utf-8", headers=headers)

    async def socket(request: web.Request) -> web.WebSocketResponse:
        answer = web.WebSocketResponse(
            timeout=_CLOSING_S, heartbeat=_HEARTBEAT_S, max_msg_size=MAX_BYTES, compress=False
        )
        await answer.prepare(request)
        sockets.add(answer)
        try:
            await _talk(answer, session)
        finally:
            sockets.discard(answer)
        return answer

    async def hang_up(_: web.Application) -> None:
        for each in list(sockets):
            with suppress(ConnectionError, asyncio.TimeoutError):
                await asyncio.wait_for(each.close(code=1001, message=b"the command has ended"), _CLOSING_S)

    app = web.Application(middlewares=[guard])
    app.router.add_get("/{token}/socket", socket)
    app.router.add_get("/{token}/{name:[^/]*}", page)
    app.on_shutdown.append(hang_up)
    return app


async def _talk(socket: web.WebSocketResponse, session: Session) -> None:
    """Listen to a browser and send it what the session shows, until it goes."""
    viewer = Viewer(socket, session.render)
    sending = asyncio.ensure_future(_send(viewer, socket))
    session.join(viewer)
    try:
        async for item in socket:
            if item.type not in (WSMsgType.TEXT, WSMsgType.BINARY):
                break
            try:
                message = read(item.data)
                if isinstance(message, Ack):
                    viewer.acknowledge(message.number)
                session.handle(viewer, message)
            except DloftbsError as error:
                viewer.post("error", encode_text("error", kind=type(error).__name__, message=str(error)))
    finally:
        session.leave(viewer)
        sending.cancel()
        with suppress(asyncio.CancelledError):
            await sending


async def _send(viewer: Viewer, socket: web.WebSocketResponse) -> None:
    try:
        await viewer.run()
    except (ConnectionError, RuntimeError) as error:  # the browser has gone, which aiohttp tells by either
        _log.debug("a browser has gone: %s", error)
        await socket.close()
    except Exception:  # noqa: BLE001 - a defect is told to whoever runs the command; the browser connects again
        _log.exception("a picture could not be made")
        await socket.close(code=1011, message=b"a picture could not be made")


@contextmanager
def serve(session: Session, host: str = LOCAL, port: int | None = None) -> Iterator[Address]:
    """Serve a session in a thread, for as long as the block lasts.

    Parameters
    ----------
    session : Session
        Closed at the end.
    host : str
        Address to bind to: by default only this machine can reach it.
    port : int, optional
        By default `PORT`, or another one where that is in use; 0 is any that is free.

    Raises
    ------
    SourceError
        If the address cannot be bound to.
    """
    access = Access(host)
    server = _Server(session, access, port)
    server.start()
    try:
        yield Address(host, server.port, access.token)
    finally:
        server.stop()
        session.close()


class _Server:
    """An event loop in a thread, with the application in it."""

    def __init__(self, session: Session, access: Access, port: int | None) -> None:
        self._session = session
        self._access = access
        self._asked_port = port
        self.port = 0
        self._loop = asyncio.new_event_loop()
        self._started = Event()
        self._ending = asyncio.Event()
        self._error: BaseException | None = None
        self._thread = Thread(target=self._run, name="dloftbs-server", daemon=True)

    def start(self) -> None:
        self._thread.start()
        self._started.wait()
        if self._error is not None:
            self._thread.join()
            self._fail(self._error)

    def _fail(self, error: BaseException) -> None:
        if isinstance(error, OSError):
            where = f"{self._access.host}:{self._asked_port or PORT}"
            raise SourceError(f"cannot serve the page at {where}: {error.strerror or error}; --port names another port")
        raise error

    def stop(self) -> None:
        if self._thread.is_alive():
            self._loop.call_soon_threadsafe(self._ending.set)
            self._thread.join()
        if self._error is not None:
            self._fail(self._error)

    def _run(self) -> None:
        asyncio.set_event_loop(self._loop)
        try:
            self._loop.run_until_complete(self._serve())
        except BaseException as error:  # noqa: BLE001 - it is raised by `start` or `stop`
            self._error = error
        finally:
            self._loop.close()
            self._started.set()

    async def _serve(self) -> None:
        app = make_app(self._session, self._access)
        runner = web.AppRunner(app, handle_signals=False, access_log=None, shutdown_timeout=_CLOSING_S)
        await runner.setup()
        try:
            self.port = await self._bind(runner)
            self._session.open(self._loop)
            self._started.set()
            await self._ending.wait()
        finally:
            await runner.cleanup()

    async def _bind(self, runner: web.AppRunner) -> int:
        ports = (PORT, 0) if self._asked_port is None else (self._asked_port,)
        for last, port in enumerate(ports, 1 - len(ports)):
            site = web.TCPSite(runner, self._access.host, port)
            try:
                await site.start()
            except OSError:
                if last == 0:
                    raise
                continue
            return int(runner.addresses[0][1])
        raise InputError("a server needs a port to listen at")
