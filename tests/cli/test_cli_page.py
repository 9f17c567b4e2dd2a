"""`dloftbs tune`, `view` and `track --view` as commands, with a client in the place of a browser."""

from __future__ import annotations

import re
import shlex
import signal
import sys
import time
from contextlib import suppress
from dataclasses import fields
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from threading import Thread

import click
import cv2
import pytest
from cli.cli_inputs import photo, run, save, start
from ui.page_client import Client

from dloftbs import Config
from dloftbs.cli.commands.track import track
from dloftbs.cli.commands.tune import tune
from dloftbs.cli.input_options import InputOptions
from dloftbs.cli.page import source_arguments
from dloftbs.config import SegmentationConfig
from dloftbs.ui.server import Address

RED = "170:10,80:255,60:255"


def opened(process):
    """Return a connection to the page that a command serves, and what it printed about that."""
    text = ""
    while "Ctrl-C ends it" not in text:
        line = process.stderr.readline()
        assert line, text
        text += line
    host, port, token = re.search(r"http://([\d.]+):(\d+)/([\w-]+)/", text).groups()
    return Client(Address(host, int(port), token)), text


@pytest.fixture
def folder(tmp_path):
    for index in range(6):
        save(tmp_path / "in" / f"{index}.png", photo(40 + index))
    return tmp_path / "in"


def test_view_shows_and_ctrl_c_ends_it(folder):
    process = start("view", folder, "--hsv", RED, "--port", 0, "--no-browser")
    client, told = opened(process)
    try:
        assert client.picture()[0]["curves"][0]["label"] == "#1"
        process.send_signal(signal.SIGINT)
        _, messages = process.communicate(timeout=20)
        assert process.returncode == 0, messages
        assert re.search(r"ssh -L (\d+):127.0.0.1:\1 \S+@\S+", told)
    finally:
        client.close()


class _Stream(BaseHTTPRequestHandler):
    """Pictures one after the other, as cameras in a network serve them."""

    def do_GET(self):
        self.send_response(200)
        self.send_header("Content-Type", "multipart/x-mixed-replace; boundary=next")
        self.end_headers()
        data = cv2.imencode(".jpg", photo(40))[1].tobytes()
        with suppress(ConnectionError):
            while True:
                self.wfile.write(b"--next\r\nContent-Type: image/jpeg\r\nContent-Length: %d\r\n\r\n" % len(data))
                self.wfile.write(data + b"\r\n")
                time.sleep(0.02)

    def log_message(self, *_):
        pass


@pytest.fixture
def stream():
    """Return the address of a stream over HTTP."""
    with ThreadingHTTPServer(("127.0.0.1", 0), _Stream) as server:
        server.daemon_threads = True
        Thread(target=server.serve_forever, daemon=True).start()
        yield f"http://127.0.0.1:{server.server_port}/video.mjpg"
        server.shutdown()


@pytest.mark.parametrize("command", ["view", "tune"])
def test_a_stream_over_http_is_read_once(stream, command):
    process = start(command, stream, "--hsv", RED, "--port", 0, "--no-browser")
    client, _ = opened(process)
    try:
        assert client.text("state")["live"]
        assert client.picture()[0]["curves"]
        assert client.picture(lambda header: header["index"] > 20)[0]["curves"]
    finally:
        client.close()
        process.send_signal(signal.SIGINT)
        _, messages = process.communicate(timeout=20)
    assert process.returncode == 0, messages


def test_track_waits_for_the_page_and_writes_what_it_writes_without(folder, tmp_path):
    out = tmp_path / "curves.csv"
    process = start("track", folder, "--hsv", RED, "--out", out, "--view", "--port", 0, "--no-browser")
    client, _ = opened(process)
    try:
        assert client.text("state")["controls"] is False
        assert client.picture(ack=False)[0]["size"] == [200, 100]
        _, messages = process.communicate(timeout=60)
        assert process.returncode == 0, messages
    finally:
        client.close()
    run("track", folder, "--hsv", RED, "--out", tmp_path / "again.csv")
    assert (tmp_path / "again.csv").read_bytes() == out.read_bytes()


def test_tune_saves_to_the_file_that_was_named_and_names_the_next_command(folder, tmp_path, monkeypatch):
    target = tmp_path / "red cable.yaml"
    process = start("tune", folder, "--out", target, "--port", 0, "--no-browser")
    client, _ = opened(process)
    try:
        client.send(type="draw", frame=0, points=[[30, 40], [170, 40]], cable=True, radius_px=2, done=True)
        client.send(type="save")
        command = shlex.split(client.text("saved")["command"])
    finally:
        client.close()
        process.send_signal(signal.SIGINT)
        process.communicate(timeout=20)
    outputs = ["--out", "curves.jsonl", "--overlay", "overlay.mp4"]
    assert command == ["dloftbs", "track", str(folder), "--config", str(target), *outputs]
    monkeypatch.chdir(tmp_path)
    run(*command[1:])
    assert (tmp_path / "curves.jsonl").stat().st_size > 100
    assert Config.from_file(target).segmentation.colour is not None


def test_options_change_what_a_file_that_is_there_says(folder, tmp_path):
    target = tmp_path / "cable.yaml"
    target.write_text("cleaning: {open_px: 5, thin_px: 9}\nlinking: {objects: 2}\n")
    as_usual = Config().cleaning.thin_px
    options = ("--set", "cleaning.close_px=7", "--set", f"cleaning.thin_px={as_usual}", "--objects", 1)
    process = start("tune", folder, "--out", target, *options, "--port", 0, "--no-browser")
    client, _ = opened(process)
    try:
        client.send(type="draw", frame=0, points=[[30, 40], [170, 40]], cable=True, radius_px=2, done=True)
        client.send(type="save")
        client.text("saved")
    finally:
        client.close()
        process.send_signal(signal.SIGINT)
        process.communicate(timeout=20)
    saved = Config.from_file(target)
    assert (saved.cleaning.open_px, saved.cleaning.close_px, saved.linking.objects) == (5, 7, 1)
    assert saved.cleaning.thin_px == as_usual


def test_a_named_colour_replaces_the_strokes_of_a_file_that_is_there(folder, tmp_path):
    target = tmp_path / "cable.yaml"
    run("colour", folder / "0.png", "--at", "30,40:170,40", "--out", target)
    assert Config.from_file(target).segmentation.colour is not None
    process = start("tune", folder, "--out", target, "--hsv", RED, "--port", 0, "--no-browser")
    client, _ = opened(process)
    try:
        assert client.text("state")["method"] == "ranges"
        client.send(type="save")
        client.text("saved")
    finally:
        client.close()
        process.send_signal(signal.SIGINT)
        process.communicate(timeout=20)
    assert Config.from_file(target).segmentation == SegmentationConfig().with_hsv(RED)


@pytest.mark.parametrize(
    ("arguments", "code", "message"),
    [
        (("tune", "IN", "--out", "cable.txt"), 2, "must end in .yaml"),
        (("tune", "nowhere.mp4"), 1, "nowhere.mp4"),
        (("view", "IN"), 1, "nothing says what in it is cable"),
        (("view", "IN", "--hsv", RED, "--host", "203.0.113.7"), 1, "cannot serve the page at 203.0.113.7"),
        (("view", "IN", "--hsv", RED, "--port", "99999"), 2, "--port"),
    ],
)
def test_what_cannot_be_is_said_at_once(folder, arguments, code, message):
    result = run(*(str(folder) if one == "IN" else one for one in arguments), code=code)
    assert message in result.stderr


def test_a_file_that_is_no_configuration_is_not_replaced(folder, tmp_path):
    (tmp_path / "notes.yaml").write_text("my: notes")
    result = run("tune", folder, "--out", tmp_path / "notes.yaml", code=1)
    assert "notes.yaml" in result.stderr
    assert (tmp_path / "notes.yaml").read_text() == "my: notes"


@pytest.mark.parametrize("command", [("tune",), ("view", "--hsv", RED), ("track", "--view", "--hsv", RED)])
def test_without_the_extra_the_line_that_installs_it_is_told(folder, monkeypatch, command):
    monkeypatch.setitem(sys.modules, "aiohttp", None)
    assert "pip install 'dloftbs[ui]'" in run(*command, folder, code=1).stderr


def test_the_arguments_of_a_source_are_told_as_a_shell_takes_them():
    context = click.Context(click.Command("tune"))
    context.params = {"kind": "auto", "depth": "my depth/", "depth_unit": 0.0001, "camera": None}
    assert source_arguments(("a b.mp4",), context) == "'a b.mp4' --depth 'my depth/' --depth-unit 0.0001"


def test_the_next_command_reads_the_source_as_this_one_did(tmp_path):
    """Every option of reading that a command has stands in the next one, too."""
    shared = {parameter.name for parameter in tune.params} & {parameter.name for parameter in track.params}
    given = {name: f"{name} x" for name in shared & {field.name for field in fields(InputOptions)}}
    context = click.Context(tune)
    context.params = {**given, "depth_unit": 0.001}
    words = shlex.split(source_arguments(("a b.mcap",), context))
    assert words[0] == "a b.mcap"
    assert {"--topic", "--depth-topic", "--info-topic"} <= set(words)
    assert set(words[1::2]) == {f"--{name.replace('_', '-')}" for name in (*given, "depth_unit")}
