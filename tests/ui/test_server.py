"""The server as a whole, over real sockets: what it gives, what it refuses, and that nothing ends it."""

from __future__ import annotations

import asyncio
import re
import socket
import sys
from contextlib import suppress

import aiohttp
import pytest
from ui.page_client import CableSource, connected, get

from dloftbs import Pipeline, ui
from dloftbs.errors import InputError, SourceError
from dloftbs.ui.security import Access
from dloftbs.ui.server import Address, page_files, serve
from dloftbs.ui.view_session import ViewFeed


@pytest.fixture(scope="module")
def address():
    feed = ViewFeed("cable.mp4", length=1)
    with serve(feed, port=0) as found:
        frame = CableSource().frame(0)
        feed.publish(frame, Pipeline(hsv="5:20").process(frame))
        yield found


def test_the_page_and_all_its_files_are_served(address):
    for name in ("", *page_files()):
        status, headers, text = get(address.url + name)
        assert (status, bool(text)) == (200, True)
        assert headers["Cache-Control"] == "no-store"
        assert headers["X-Content-Type-Options"] == "nosniff"
        assert "default-src 'none'" in headers["Content-Security-Policy"]
    assert headers["Content-Type"].startswith("text/")


def test_the_page_asks_no_other_host_and_has_no_code_in_it():
    texts = {name: data.decode() for name, (_, data) in page_files().items()}
    assert {"index.html", "main.js", "style.css", "icon.svg"} <= texts.keys()
    for text in texts.values():
        assert set(re.findall(r"(?:https?:)?//[\w.-]+\.\w+", text)) <= {"http://www.w3.org"}  # a name, not a place
    assert not re.search(r"<script(?![^>]*src=)|\son\w+=|style=", texts["index.html"])


@pytest.mark.parametrize(
    "path",
    ["../server.py", "..%2Fserver.py", "%2e%2e/server.py", "page/index.html", "/etc/passwd", "%2Fetc%2Fpasswd",
     "main.js%00", "index.html/", "C:%5Cwindows", "__init__.py"],
)  # fmt: skip
def test_no_other_file_can_be_had(address, path):
    status, _, text = get(address.url + path)
    assert status in (403, 404)
    assert "import" not in text


@pytest.mark.parametrize("token", ["", "wrong", "x" * 24, "%00", "../"])
@pytest.mark.parametrize("name", ["", "main.js", "socket"])
def test_without_the_token_there_is_nothing(address, token, name):
    status, _, text = get(f"http://{address.authority}/{token}/{name}")
    assert (status, "token" in text) == (403, True)


@pytest.mark.parametrize(
    "headers",
    [{"Host": "evil.example"}, {"Origin": "http://evil.example"}, {"Origin": "null"}, {"Host": "10.0.0.1:80"}],
)
@pytest.mark.parametrize("name", ["", "main.js", "socket"])
def test_other_names_and_pages_of_others_are_refused(address, headers, name):
    assert get(address.url + name, **headers)[0] == 403


def test_a_socket_of_another_page_is_refused(address):
    async def ask():
        async with aiohttp.ClientSession() as session:
            with pytest.raises(aiohttp.WSServerHandshakeError, match="403"):
                await session.ws_connect(address.url + "socket", origin="http://evil.example")

    asyncio.run(ask())


@pytest.mark.parametrize(
    "text",
    ["", "{", "null", '{"type": "ack"}', '{"type": "open", "path": "/etc/passwd"}', '{"type": "save"}', "[" * 9999],
)
def test_bad_messages_are_answered_and_harm_nothing(address, text):
    with connected(address) as client:
        client.send_text(text)
        error = client.text("error")
        assert error["kind"] == "InputError"
        assert "message" in error["message"]
        assert client.picture()[0]["number"] == 1


def test_a_message_that_is_too_large_ends_that_connection_alone(address):
    with connected(address) as client, connected(address) as other:
        with suppress(ConnectionError):  # the server may close before it has read all of it
            client.send_text(" " * (1 << 21))
        while client.receive() is not None:
            pass
        assert client.socket.closed
        assert other.picture()[0]["curves"]


def test_a_picture_that_cannot_be_made_ends_the_connection_and_is_told(caplog):
    class Broken(ViewFeed):
        async def render(self, viewer):
            raise ZeroDivisionError

    with serve(Broken("cable.mp4"), port=0) as address:
        for _ in range(2):
            with connected(address) as client:
                while client.receive() is not None:
                    pass
                assert client.socket.closed
    assert [record.message for record in caplog.records] == ["a picture could not be made"] * 2


def test_a_port_that_is_taken_is_an_error_where_it_was_asked_for():
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        port = taken.getsockname()[1]
        with pytest.raises(SourceError, match=f"127.0.0.1:{port}: .*--port"), serve(ViewFeed("x"), port=port):
            pytest.fail("served")


def test_an_address_that_is_not_of_this_machine_is_an_error():
    with (
        pytest.raises(SourceError, match=r"cannot serve the page at 203\.0\.113\.7"),
        serve(ViewFeed("x"), "203.0.113.7"),
    ):
        pytest.fail("served")


def test_two_commands_find_two_ports():
    with serve(ViewFeed("a")) as one, serve(ViewFeed("b")) as other:
        assert one.port != other.port
        assert one.token != other.token
        assert get(one.url)[0] == get(other.url)[0] == 200
        assert get(f"http://{one.authority}/{other.token}/")[0] == 403


def test_the_server_listens_to_this_machine_alone(address):
    assert address.url.startswith("http://127.0.0.1:")
    assert Access().host == "127.0.0.1"


@pytest.mark.parametrize(("host", "authority"), [("0.0.0.0", "127.0.0.1:1"), ("::1", "[::1]:1"), ("robot", "robot:1")])
def test_addresses_can_be_opened(host, authority):
    assert Address(host, 1, "t").url == f"http://{authority}/t/"


def test_without_the_extra_the_line_that_installs_it_is_told(monkeypatch):
    monkeypatch.setitem(sys.modules, "aiohttp", None)
    with pytest.raises(InputError, match=r"pip install 'dloftbs\[ui\]'"):
        ui.require()
