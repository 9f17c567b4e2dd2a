"""Paths that no file has, or that lead to what is no file, through every public door: an error of ours, and no wait."""

from __future__ import annotations

import os
import socket
import sys
import threading
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from cli.cli_inputs import RUNNER

import dloftbs
from dloftbs import Config, DepthRegistration, Frame, PinholeCamera, detect, ros, sinks, sources
from dloftbs.cli import main
from dloftbs.errors import ConfigError, DloftbsError, InputError, SinkError, SourceError
from dloftbs_lab import open_labelled

MASK = np.zeros((60, 80), np.uint8)
MASK[20:24, 5:60] = 255

NAMELESS = {
    "a null byte": "a\0b{}",
    "a folder with a null byte": "a\0b/c{}",
    "a pattern with a null byte": "*\0*{}",
    "a lone surrogate": "\ud800{}",
    "a pattern with a lone surrogate": "**/\ud800*{}",
}
"""Texts that no file system has for a name."""
MISSING = {
    "a long name": "x" * 300 + "{}",
    "a long path": "y/" * 3000 + "a{}",
    "a byte that is no UTF-8": "\udcff{}",
    "an unknown user": "~nobody-has-this-name/a{}",
    "a link to nothing": "broken{}",
    "a link to itself": "loop{}",
    "below a link to itself": "loop{}/a{}",
    "below a file": "mask.png/a{}",
}
"""Names that are well formed, and lead to nothing."""
NO_FILE = {"a pipe": "pipe{}", "a socket": "socket{}", "a device": os.devnull}
ENDINGS = ("", ".png", ".tif", ".jpg", ".npy", ".npz", ".mp4", ".mcap", ".bag", ".db3", ".yaml")

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="links, pipes and sockets of POSIX")


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    monkeypatch.chdir(tmp_path)
    cv2.imwrite("mask.png", MASK)
    cv2.imwrite("image.png", np.dstack([MASK, MASK // 2, MASK]))
    with socket.socket(socket.AF_UNIX) as bound:
        bound.bind("socket")
        for ending in ENDINGS:
            os.symlink(f"nowhere{ending}", f"broken{ending}")
            os.symlink(f"loop{ending}", f"loop{ending}")
            os.mkfifo(f"pipe{ending}")
            if ending:
                os.symlink("socket", f"socket{ending}")
        yield tmp_path


def texts(kinds: dict[str, str], ending: str) -> list[str]:
    return [text.replace("{}", ending) for text in kinds.values()]


def at_once(call: Callable[[], Any]) -> BaseException | None:
    """Return the error of a call, which must not wait for anybody."""
    raised: list[BaseException | None] = []

    def run() -> None:
        try:
            call()
            raised.append(None)
        except BaseException as error:  # noqa: BLE001 - given back
            raised.append(error)

    thread = threading.Thread(target=run, daemon=True)
    thread.start()
    thread.join(60)
    assert raised, "it waits"
    return raised[0]


def read_all(where: Any, **options: Any) -> None:
    with sources.open(where, **options) as source:
        list(source)


def read_recording(path: str) -> None:
    with ros.BagSource(path) as source:
        list(source)


READERS: dict[str, tuple[Callable[[Any], object], tuple[str, ...], type[DloftbsError]]] = {
    "sources.open": (read_all, ENDINGS, SourceError),
    "sources.open of a Path": (lambda text: read_all(Path(text)), ENDINGS, SourceError),
    "sources.open of a list": (lambda text: read_all([text]), (".png",), SourceError),
    "depth": (lambda text: read_all("mask.png", depth=text), ENDINGS, SourceError),
    "masks": (lambda text: read_all("image.png", masks=text), ENDINGS, SourceError),
    "occluders": (lambda text: read_all("mask.png", occluders=text), ENDINGS, SourceError),
    "instances": (lambda text: read_all("image.png", instances=text), (*ENDINGS, ".json", ".txt"), SourceError),
    "camera": (lambda text: read_all("mask.png", camera=text), (".yaml",), SourceError),
    "registration": (lambda text: read_all("mask.png", registration=text), (".yaml",), SourceError),
    "track": (lambda text: list(dloftbs.track(text)), (".png", ".mp4"), SourceError),
    "PinholeCamera.from_file": (PinholeCamera.from_file, (".yaml", ""), SourceError),
    "DepthRegistration.from_file": (DepthRegistration.from_file, (".yaml", ""), SourceError),
    "Config.from_file": (Config.from_file, (".yaml", ""), ConfigError),
    "open_labelled": (open_labelled, ("",), SourceError),
    "Recording": (ros.Recording, ("", ".mcap", ".bag", ".db3"), SourceError),
    "BagSource": (read_recording, ("", ".mcap", ".bag", ".db3"), SourceError),
    "read_npz": (sinks.read_npz, (".npz",), SourceError),
}


@pytest.mark.parametrize("door", READERS)
def test_what_cannot_be_read_is_an_error_of_ours(here: Path, door: str) -> None:
    read, endings, missing = READERS[door]
    for ending in endings:
        for text in texts(NAMELESS, ending):
            error = at_once(lambda text=text: read(text))
            assert isinstance(error, (InputError, ConfigError)), (ending, text, error)
            assert "null byte" in str(error) or "ud800" in str(error)
        for text in texts(MISSING, ending):
            error = at_once(lambda text=text: read(text))
            assert isinstance(error, missing), (ending, text, error)
        for text in texts(NO_FILE, ending):
            if (missing, text) == (ConfigError, os.devnull):  # an empty file, which states nothing
                continue
            error = at_once(lambda text=text: read(text))
            assert isinstance(error, missing), (ending, text, error)


@pytest.mark.parametrize("what", ["depth", "masks", "occluders", "instances"])
def test_naming_rules(here: Path, what: str, caplog: pytest.LogCaptureFixture) -> None:
    for text in texts(NAMELESS, ".png"):
        assert isinstance(at_once(lambda text=text: read_all("image.png", **{what: "{stem}" + text})), InputError)
    for ending in (".png", ".npy"):
        for place in ("pipe", "socket", "loop", "broken"):
            os.symlink(here / f"{place}{ending}", f"image_{place}{ending}")
            caplog.clear()
            assert at_once(lambda rule=f"{{stem}}_{place}{ending}": read_all("image.png", **{what: rule})) is None
            assert "frame 0 goes without" in caplog.text


def test_a_list_of_lines_that_is_not_there(here: Path) -> None:
    for text in (*texts(NAMELESS, ".jsonl"), *texts(MISSING, ".jsonl")):
        assert isinstance(at_once(lambda text=text: list(sinks.read_json_lines(text))), DloftbsError), text


SINKS: tuple[tuple[Callable[[str], sinks.Sink], str], ...] = (
    *(
        (sinks.open, ending)
        for ending in (".jsonl", ".npz", ".csv", ".ply", ".obj", ".usda", ".xml", ".mp4", ".png", ".mcap", "")
    ),
    *((kind, ".x") for kind in (sinks.JsonLinesSink, sinks.NpzSink, sinks.CsvSink, sinks.OverlayImagesSink)),
    (sinks.GeometrySink, ".ply"),
    (sinks.UsdSink, ".usda"),
    (sinks.MujocoSink, ".xml"),
    (sinks.OverlayVideoSink, ".mov"),
    (sinks.OverlayPictureSink, ".jpg"),
    (ros.BagSink, ".x"),
)


@pytest.mark.parametrize(("make", "ending"), SINKS)
def test_what_cannot_be_written_is_an_error_of_ours(here: Path, make: Callable[[str], sinks.Sink], ending: str) -> None:
    frame, result = Frame(mask=MASK), detect(MASK)

    def write(path: str) -> None:
        with make(path) as sink:
            sink.write(frame, result)

    os.symlink(f"loop{ending}", f"again{ending}")
    for text in texts(NAMELESS, ending):
        assert isinstance(at_once(lambda text=text: write(text)), InputError), text
    for text in ("x" * 300 + ending, "y/" * 3000 + "a" + ending, f"mask.png/a{ending}", f"loop/a{ending}"):
        assert isinstance(at_once(lambda text=text: write(text)), SinkError), text
    os.mkdir("\udcff")
    error = at_once(lambda: write(f"\udcff/a{ending}"))  # a name that is no UTF-8 is one all the same
    assert error is None or "nothing was written" in str(error)  # there is no curve in space


@pytest.mark.parametrize(
    ("make", "ending"), [(sinks.open, ".png"), (sinks.open, ".jsonl"), (sinks.open, ".csv"), (sinks.open, ".mp4")]
)
def test_what_is_written_to_a_pipe_goes_into_it(here: Path, make: Callable[[str], sinks.Sink], ending: str) -> None:
    name = f"written{ending}"
    os.mkfifo(name)
    read: list[bytes] = []
    reader = threading.Thread(target=lambda: read.append(Path(name).read_bytes()), daemon=True)
    reader.start()

    def write() -> None:
        with make(name) as sink:
            if ending != ".mp4":
                sink.write(Frame(mask=MASK), detect(MASK))

    assert at_once(write) is None
    reader.join(60)
    assert bool(read[0]) == (ending != ".mp4")
    assert Path(name).is_fifo()  # it was neither replaced nor removed


@pytest.mark.parametrize("ending", [".npz", ".ply", ".obj", ".usda", ".xml"])
def test_what_must_be_replaced_as_a_whole_is_no_pipe(here: Path, ending: str) -> None:
    os.mkfifo(f"written{ending}")
    error = at_once(lambda: sinks.open(f"written{ending}"))
    assert isinstance(error, SinkError)
    assert "must be a file" in str(error)
    assert Path(f"written{ending}").is_fifo()


def test_a_folder_where_a_file_is_expected(here: Path) -> None:
    for ending in (".png", ".npy", ".npz", ".mp4", ".yaml", ".jsonl", ".mcap"):
        os.mkdir(f"folder{ending}")
    for read, ending in (
        (PinholeCamera.from_file, ".yaml"),
        (DepthRegistration.from_file, ".yaml"),
        (sinks.read_npz, ".npz"),
        (lambda path: list(sinks.read_json_lines(path)), ".jsonl"),
        (read_all, ".mp4"),
        (read_recording, ".mcap"),
    ):
        assert isinstance(at_once(lambda read=read, ending=ending: read(f"folder{ending}")), SourceError), ending
    assert isinstance(at_once(lambda: Config.from_file("folder.yaml")), ConfigError)


def test_a_folder_in_which_no_name_is_short_enough(here: Path) -> None:
    folder = "/".join(["f" * 250] * 16 + ["g" * 74])  # with the name of a file in it, more than a path may have
    os.makedirs(folder)
    for read in (open_labelled, read_all, read_recording):
        error = at_once(lambda read=read: read(folder))
        assert isinstance(error, SourceError), error


def test_a_network_of_no_name_is_refused() -> None:
    with pytest.raises(ConfigError, match="file must be the path of an ONNX model, in UTF-8"):
        Config.from_dict({"segmentation": {"onnx": {"file": "model\udcff.onnx"}}})


def test_settings_come_through_a_pipe_that_somebody_writes_to(here: Path) -> None:
    reading, writing = os.pipe()
    os.write(writing, b"linking: {objects: 3}")
    os.close(writing)
    try:
        assert Config.from_file(f"/dev/fd/{reading}").linking.objects == 3
    finally:
        os.close(reading)
    error = at_once(lambda: Config.from_file("pipe.yaml"))
    assert isinstance(error, ConfigError)
    assert "a pipe that nobody writes to" in str(error)


@pytest.mark.parametrize(
    ("arguments", "ending"),
    [
        (["detect", "{}"], ".png"),
        (["track", "{}"], ".mp4"),
        (["detect", "mask.png", "--depth", "{}"], ".png"),
        (["detect", "image.png", "--masks", "{}"], ".npy"),
        (["detect", "image.png", "--instances", "{}"], ".json"),
        (["detect", "mask.png", "--camera", "{}"], ".yaml"),
        (["detect", "mask.png", "--registration", "{}"], ".yaml"),
        (["detect", "mask.png", "--config", "{}"], ".yaml"),
        (["config", "check", "{}"], ".yaml"),
        (["colour", "{}", "--at", "3,3"], ".png"),
        (["colour", "image.png", "--at", "9,21", "--config", "{}"], ".yaml"),
        (["evaluate", "{}", "--out", "results"], ""),
        (["detect", "mask.png", "--out", "{}"], ".jsonl"),
        (["detect", "mask.png", "--overlay", "{}"], ".png"),
        (["detect", "mask.png", "--stages", "{}"], ".png"),
        (["colour", "image.png", "--at", "9,21", "--out", "{}"], ".yaml"),
        (["colour", "image.png", "--at", "9,21", "--overlay", "{}"], ".png"),
    ],
)
def test_the_command_ends_with_a_message(here: Path, arguments: list[str], ending: str) -> None:
    for text in (*texts(NAMELESS, ending), "x" * 300 + ending, "y/" * 3000 + "a" + ending, f"mask.png/a{ending}"):
        result = RUNNER.invoke(main, [argument.replace("{}", text) for argument in arguments])
        assert isinstance(result.exception, SystemExit), (text, result.exception)
        assert result.exit_code in (1, 2)


def test_the_colour_of_a_picture_whose_name_is_no_utf_8(here: Path) -> None:
    os.rename("image.png", "\udcff.png")
    result = RUNNER.invoke(main, ["colour", "\udcff.png", "--at", "9,21", "--out", "colour.yaml"])
    assert result.exit_code == 0, result.output
    assert Config.from_file("colour.yaml").segmentation.colour is not None
    os.mkdir("folder")
    result = RUNNER.invoke(main, ["colour", "\udcff.png", "--at", "9,21", "--out", "folder"])
    assert (result.exit_code, type(result.exception)) == (1, SystemExit)
