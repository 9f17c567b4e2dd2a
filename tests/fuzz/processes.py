"""What happens to outputs: kills, full disks, two writers, closed pipes, hostile names."""

from __future__ import annotations

import os
import resource
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from cli.cli_inputs import COMMAND, start
from sinks import sink_examples as examples

from dloftbs import DloftbsError, SinkError, sinks
from fuzz import masks
from fuzz.checks import own

Rng = np.random.Generator

PATIENCE_S = 120.0
"""How long is waited for a process, on however busy a machine."""
DATA = ("a.jsonl", "a.npz", "a.csv")


@dataclass(frozen=True)
class Kill:
    """A signal for a run that writes everything, when so many bytes of its lines are there."""

    signal: int
    bytes: int


def kill(rng: Rng) -> Kill:
    return Kill(int(rng.choice([signal.SIGKILL, signal.SIGINT, signal.SIGTERM])), int(rng.integers(0, 60_000)))


def check_kill(case: Kill, folder: Path) -> None:
    """Check that what a run wrote until it was killed can be read."""
    mask = masks.tangle(np.random.default_rng(8), (120, 160))
    np.savez(folder / "masks.npz", masks=np.stack([np.roll(mask, i % 40, 1) for i in range(600)]))
    outs = [argument for name in DATA for argument in ("--out", str(folder / name))]
    with start("track", folder / "masks.npz", *outs, "--overlay", folder / "o.mp4") as process:
        lines, since = folder / "a.jsonl", time.monotonic()
        while process.poll() is None and time.monotonic() - since < PATIENCE_S:
            if lines.is_file() and lines.stat().st_size > case.bytes:
                break
            time.sleep(0.005)
        process.send_signal(case.signal)
        _, words = process.communicate(timeout=PATIENCE_S)
    assert "Traceback" not in words, words
    if case.signal == signal.SIGINT:
        assert process.returncode in (0, 130), f"{process.returncode}: {words}"
    check_readable(folder)


def check_readable(folder: Path) -> None:
    """Check that what there is of the outputs can be read, and is whole but for its last line."""
    if (folder / "a.jsonl").is_file():
        records = list(sinks.read_json_lines(folder / "a.jsonl"))
        assert [record["index"] for record in records] == list(range(len(records)))
    if (folder / "a.npz").is_file():
        sinks.read_npz(folder / "a.npz")
    if (folder / "a.csv").is_file():
        rows = (folder / "a.csv").read_bytes().split(b"\n")
        assert len({row.count(b",") for row in rows[:-1]}) <= 1


@contextmanager
def _file_size(limit: int) -> Iterator[None]:
    """Let no file grow beyond a number of bytes: a disk that is full, as far as a writer can see."""
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (limit, hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))


KINDS = ("a.jsonl", "a.npz", "a.csv", "a.ply", "a.usda", "a.xml", "a.mp4", "pictures")


@dataclass(frozen=True)
class FullDisk:
    """A sink, and the size beyond which no file grows."""

    name: str
    bytes: int


def full_disk(rng: Rng) -> FullDisk:
    return FullDisk(KINDS[int(rng.integers(len(KINDS)))], int(np.exp(rng.uniform(0, np.log(200_000)))))


def _opened(folder: Path, name: str) -> sinks.Sink:
    return examples.open_sink(f"{folder}/{name}")


def check_full_disk(case: FullDisk, folder: Path) -> None:
    """Check that a full disk is an error of our own, after which the outputs hold whole records alone."""

    def write() -> None:
        with _opened(folder, case.name) as sink:
            for i in range(30):
                sink.write(examples.frame(i), examples.detected(i, in_space=True))

    with _file_size(case.bytes):
        error = own(write)
    assert error is None or isinstance(error, SinkError), repr(error)
    for name in ("a.jsonl", "a.csv"):
        content = (folder / name).read_bytes() if (folder / name).is_file() else b""
        assert content == b"" or content.endswith(b"\n"), f"{name} ends in the middle of a line: {content[-60:]!r}"
    check_readable(folder)


FULL_DISKS_FOUND = {
    "JSON lines": FullDisk("a.jsonl", 5000),
    "CSV": FullDisk("a.csv", 5000),
    "a header alone": FullDisk("a.csv", 10),
    "NPZ": FullDisk("a.npz", 3000),
}

_HOLDER = """
import sys
from pathlib import Path
from fuzz.processes import _opened, examples
with _opened(Path(sys.argv[1]), sys.argv[2]) as sink:
    sink.write(examples.frame(0), examples.detected(0, in_space=True))
    sys.stdout.write("open\\n")
    sys.stdout.flush()
    sys.stdin.read()
"""


def two_writers(rng: Rng) -> str:
    return str(rng.choice(["a.jsonl", "a.npz", "a.csv", "a.mp4"]))


def _contents(folder: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in folder.iterdir() if path.is_file()}


def check_two_writers(name: str, folder: Path) -> None:
    """Check that a second writer of a file is refused while the first one lives, and not after it died."""
    command = [sys.executable, "-c", _HOLDER, str(folder), name]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as first:
        assert first.stdout is not None
        assert first.stdin is not None
        assert first.stdout.readline() == "open\n"
        before = _contents(folder)
        assert isinstance(own(lambda: _write_one(folder, name)), DloftbsError), "a second writer was let in"
        assert _contents(folder) == before, "the second writer changed what the first one wrote"
        first.kill()
    _write_one(folder, name)
    check_readable(folder)


def _write_one(folder: Path, name: str) -> None:
    with _opened(folder, name) as sink:
        sink.write(examples.frame(0), examples.detected(0, in_space=True))


@dataclass(frozen=True)
class Names:
    """Names of frames, and a sink."""

    sink: str
    names: tuple[str, ...]


_PARTS = (
    *("..", "/", "\\", ".", "x", "~", "con", "nul", "a:b", "*", "?", "%s", "\n", "\r", "\t", " ", "\udcff", "\ud800"),
    *("é", "漢", "\u202e", "x" * 300, ".png", ".mp4", "-", "--help", "#0", "\x07", "'", '"', ",", "{stem}", "$HOME"),
)


def names(rng: Rng) -> Names:
    drawn = tuple(
        "".join(_PARTS[int(i)] for i in rng.integers(0, len(_PARTS), int(rng.integers(0, 6)))) for _ in range(4)
    )
    return Names(KINDS[int(rng.integers(len(KINDS)))], drawn)


_HOSTILE = ("../../x", "/tmp/x.png", "../out.png", "..", "", "a" * 5000, "caf\udce9.png", "x\0y", "a\nb", "~/x")
NAMES_FOUND = {f"hostile names, {kind}": Names(kind, _HOSTILE) for kind in KINDS}


def check_names(case: Names, folder: Path) -> None:
    """Check that no name of a frame leads out of the folder of the output, or ends the writing."""
    inner = folder / "deep" / "out"
    inner.mkdir(parents=True)
    (folder / "outside.txt").write_text("mine")

    def write() -> None:
        with _opened(inner, case.sink) as sink:
            for i, name in enumerate(case.names):
                sink.write(examples.frame(i, name=name), _renamed(i, name))

    own(write)
    strays = [path for path in folder.rglob("*") if inner not in (path, *path.parents) and path != inner.parent]
    assert [path.name for path in strays] == ["outside.txt"], f"written outside of the folder: {strays}"
    assert not Path("/tmp/x.png").exists()
    check_readable(inner)


def _renamed(index: int, name: str) -> Any:
    from dataclasses import replace

    return replace(examples.detected(index, in_space=True), name=name)


@dataclass(frozen=True)
class Ending:
    """A run of the command whose standard output goes somewhere, in a locale."""

    where: str
    file: bytes
    locale: str = "C.UTF-8"


ENDINGS_FOUND = {
    "a full device": Ending("/dev/full", b"mask.png"),
    "a closed output": Ending("closed", b"mask.png"),
    "a closed pipe": Ending("pipe", b"mask.png"),
    "a name that is no UTF-8": Ending("/dev/null", b"caf\xe9.png"),
    "a name that is no ASCII in a POSIX locale": Ending("/dev/null", "café.png".encode(), "POSIX"),
}


def ending(rng: Rng) -> Ending:
    where = str(rng.choice(["/dev/full", "closed", "pipe", "/dev/null"]))
    file = bytes(rng.choice([97, 0xE9, 0xC3, 0xA9, 32, 10, 0xFF, 42, 91], int(rng.integers(1, 12))).astype(np.uint8))
    return Ending(where, file + b".png", str(rng.choice(["C.UTF-8", "POSIX"])))


def check_ending(case: Ending, folder: Path) -> None:
    """Check how a run ends whose output is lost, or whose input has a strange name."""
    import cv2

    content = cv2.imencode(".png", 255 * masks.tangle(np.random.default_rng(2), (60, 80)))[1].tobytes()
    inputs = folder / "in"
    inputs.mkdir()
    for i in range(30 if case.where == "pipe" else 1):
        path = os.path.join(os.fsencode(inputs), b"%d" % i + case.file)
        with open(path, "wb") as file:
            file.write(content)
    kinds = ["--kind", "mask"]
    shell = {"closed": "exec {} >&-", "pipe": "{} | true; exit ${{PIPESTATUS[0]}}"}.get(
        case.where, f"exec {{}} > {case.where}"
    )
    command = " ".join([str(COMMAND), "detect", str(inputs), *kinds])
    environment = {**os.environ, "LC_ALL": case.locale, "PYTHONUTF8": "0", "PYTHONCOERCECLOCALE": "0"}
    done = subprocess.run(
        ["bash", "-c", shell.format(command)], capture_output=True, env=environment, timeout=PATIENCE_S, check=False
    )
    words = done.stderr.decode(errors="backslashreplace")
    assert "Traceback" not in words, words
    assert "Exception ignored" not in words, words
    if case.where == "/dev/null":
        assert done.returncode == 0, f"{done.returncode}: {words}"
    elif case.where == "/dev/full":
        assert done.returncode == 1, f"{done.returncode}: {words}"
        assert words.strip()
    else:
        assert done.returncode not in (0, -signal.SIGSEGV, -signal.SIGABRT) or case.where == "pipe", done.returncode
