"""The command with hostile arguments, and outputs that are inputs, in this process."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from cli.cli_inputs import RUNNER

from dloftbs.cli import main
from fuzz import masks
from fuzz.files import CALIBRATIONS, video_bytes

Rng = np.random.Generator


@dataclass(frozen=True)
class Call:
    """The arguments of a command, run in the folder that `prepare` fills."""

    arguments: tuple[str, ...]


@contextmanager
def inside(folder: Path) -> Iterator[None]:
    """Work in a folder."""
    before = Path.cwd()
    os.chdir(folder)
    try:
        yield
    finally:
        os.chdir(before)


def prepare(folder: Path) -> None:
    """Fill a folder with inputs of every kind, and links to them."""
    mask = masks.tangle(np.random.default_rng(5), (60, 80))
    image = np.zeros((60, 80, 3), np.uint8)
    image[mask > 0] = (0, 0, 255)
    cv2.imwrite(str(folder / "photo.png"), image)
    (folder / "frames").mkdir()
    for i in range(3):
        cv2.imwrite(str(folder / "frames" / f"{i:03}.png"), np.roll(255 * mask, i, 0))
        cv2.imwrite(str(folder / "frames" / f"{i:03}_depth.png"), np.full(mask.shape, 700, np.uint16))
    np.savez(folder / "a.npz", masks=np.stack([mask] * 3))
    np.save(folder / "a.npy", np.stack([mask] * 2))
    (folder / "cable.mp4").write_bytes(video_bytes())
    for name, text in zip(("ros.yaml", "opencv.yaml"), CALIBRATIONS, strict=False):
        (folder / name).write_text(text)
    (folder / "settings.yaml").write_text("linking: {objects: 1}\n")
    (folder / "soft.png").symlink_to("photo.png")
    os.link(folder / "photo.png", folder / "hard.png")
    os.link(folder / "a.npz", folder / "hard.npz")
    (folder / "same").symlink_to("frames")
    (folder / "film.mp4").symlink_to("cable.mp4")
    (folder / "loop").symlink_to(".")
    (folder / "dangling.png").symlink_to("nowhere.png")


INPUTS = (
    *("photo.png", "frames", "a.npz", "a.npy", "cable.mp4", "soft.png", "hard.png", "same", "film.mp4", "frames/*.png"),
    *("./frames/../photo.png", "frames/*[0-9].png", "loop/photo.png", "dangling.png"),
)
DATA_OUTPUTS = (
    "out.jsonl",
    "out.csv",
    "out.npz",
    "a.npz",
    "loop/a.npz",
    "-",
    "new/deeper/out.csv",
    "out.ply",
    "hard.npz",
)
PICTURE_OUTPUTS = (
    *(".", "out", "out.mp4", "out.png", "photo.png", "frames", "cable.mp4", "soft.png", "hard.png", "same", "film.mp4"),
    *("loop/cable.mp4", "loop/frames", "frames/000.png", "frames/..", "loop", "dangling.png", "new/deeper/"),
)
_BAD = (
    *(
        "",
        " ",
        "-",
        "--",
        "-1",
        "0",
        "1e400",
        "nan",
        "9" * 30,
        "\udcff",
        "a\0b"[:1],
        "../../x",
        "/",
        "/dev/null",
        "x" * 5000,
    ),
    *(
        "~",
        "~nobody/x",
        "{stem}",
        "{stem}_depth.png",
        "{}",
        "{stem:99999999}",
        "*",
        "**",
        "[",
        "**/*",
        "99999999999999999999",
    ),
    *("http://", "file:///etc", "rtsp:", "%", "170:10", "0:179,0:255,0:255", "1:2:3", "linking.objects=1", "linking=1"),
    *(
        "linking.objects=&a [*a]",
        "a.b.c=1",
        "=",
        "lifting.method=pixels",
        "tracking.gate=1e400",
        "100,100,40,30",
        "nan,1,1,1",
    ),
)
_FITTING = {
    "--kind": ("auto", "image", "mask"),
    "--depth": ("{stem}_depth.png", "frames/*_depth.png", "a.npz"),
    "--masks": ("frames", "a.npz", "a.npy", "{stem}.png"),
    "--instances": ("frames", "a.npy", "{stem}_*.png", "{stem}.png"),
    "--camera": ("100,100,40,30", "ros.yaml", "opencv.yaml"),
    "--registration": ("ros.yaml",),
    "--config": ("settings.yaml",),
    "--set": ("linking.objects=1", "lifting.method=pixels", "tracking.gate=0.2"),
    "--hsv": ("170:10,80:255,60:255", "0:179"),
    "--depth-unit": ("0.001", "1"),
    "--out": DATA_OUTPUTS,
    "--overlay": PICTURE_OUTPUTS,
    "--stages": PICTURE_OUTPUTS,
    "--limit": ("1", "2"),
    "--fps": ("30",),
    "--jobs": ("1", "2"),
}
"""Values of options that may go together with the rest."""
_OPTIONS = tuple(_FITTING)


def call(rng: Rng) -> Call:
    """A command with options and values of which some go together."""
    arguments = [str(rng.choice(["detect", "track", "detect", "track", "config"]))]
    arguments += ["print"] if arguments[0] == "config" else [_drawn(rng, INPUTS)]
    for _ in range(int(rng.integers(0, 4))):
        option = str(rng.choice(_OPTIONS))
        arguments += [option, _drawn(rng, _FITTING[option])]
    if rng.random() < 0.2:
        arguments.insert(int(rng.integers(len(arguments) + 1)), _drawn(rng, _BAD))
    return Call(tuple(arguments))


def _drawn(rng: Rng, good: tuple[str, ...]) -> str:
    pool = good if rng.random() < 0.85 else _BAD
    return pool[int(rng.integers(len(pool)))]


CALLS_FOUND = {
    name: Call(tuple(text.split(" ")))
    for name, text in {
        "a limit of 20 digits": "track frames --limit 99999999999999999999",
        "an input of nothing": "track ",
        "a demo of 10 ** 16 pixels": "demo --size 99999999x99999999 --out demo",
        "globs into looping links": "track **/*.png --kind mask",
        "globs of globs": "track **/**/**/*.png --kind mask",
        "a track that is partly hidden, on standard output": "track a.npz",
        "a unit of 1e-300": "track frames/*[0-9].png --depth {stem}_depth.png --camera 9,9,9,9 --depth-unit 1e-300",
    }.items()
}


def run(case: Call, folder: Path) -> int:
    """Run a command in a folder; return its exit code, if it ended as it should."""
    with inside(folder):
        result = RUNNER.invoke(main, list(case.arguments))
    if result.exception is not None and not isinstance(result.exception, SystemExit):
        raise result.exception
    assert result.exit_code in (0, 1, 2), f"exit code {result.exit_code}"
    assert "Traceback" not in result.stderr
    if result.exit_code:
        assert result.stderr.strip(), f"exit code {result.exit_code} without a word"
    return result.exit_code


def check_call(case: Call, folder: Path) -> None:
    """Check how a command ends, and that its inputs are there and whole afterwards."""
    prepare(folder)
    inputs = _inputs(case, folder)
    before = {path: path.read_bytes() for path in inputs}
    run(case, folder)
    for path, content in before.items():
        assert path.is_file(), f"the input {path.name} is gone"
        assert path.read_bytes() == content, f"the input {path.name} was replaced"


def _inputs(case: Call, folder: Path) -> list[Path]:
    """Return the files that the arguments name as inputs."""
    named: list[str] = []
    for before, argument in zip(("", *case.arguments), case.arguments, strict=False):
        if before in ("--depth", "--masks", "--instances", "--camera", "--config", "--registration", "detect", "track"):
            named.append(argument)
    found: list[Path] = []
    for name in named:
        if name == "" or "\0" in name or "**" in name or name.startswith(("/", "~")) or len(name) > 200:
            continue
        place = folder / name
        matches = [place] if place.exists() else list(folder.glob(name)) if "*" in name and "{" not in name else []
        for match in matches:
            found += [path for path in match.iterdir() if path.is_file()] if match.is_dir() else [match]
    return [path for path in found if path.is_file()]


def over_input(rng: Rng) -> Call:
    """A command of which an output may well be an input."""
    command, where = str(rng.choice(["detect", "track"])), _one(rng, INPUTS)
    arguments = [command, where]
    options = ("--overlay", "--out", "--stages") if command == "detect" else ("--overlay", "--out")
    for option in rng.permutation(options)[: int(rng.integers(1, 3))].tolist():
        arguments += [option, where if rng.random() < 0.4 else _one(rng, _FITTING[option])]
    if rng.random() < 0.2:
        arguments += ["--masks", _one(rng, ("a.npz", "frames", "a.npy"))]
    if rng.random() < 0.2:
        arguments += ["--depth", _one(rng, ("{stem}_depth.png", "frames/*_depth.png"))]
    if rng.random() < 0.7:
        arguments += ["--hsv", "170:10,80:255,60:255"]
    return Call(tuple(arguments))


def _one(rng: Rng, pool: tuple[str, ...]) -> str:
    return pool[int(rng.integers(len(pool)))]


OVER_INPUT_FOUND = {
    text: Call(tuple(text.split(" ")))
    for text in (
        "detect photo.png --hsv 170:10,80:255,60:255 --overlay .",
        "detect photo.png --hsv 170:10,80:255,60:255 --stages .",
        "detect photo.png --hsv 170:10,80:255,60:255 --overlay photo.png",
        "track frames --kind mask --overlay frames",
        "track same --kind mask --overlay frames",
        "track a.npz --out a.npz",
        "track cable.mp4 --hsv 170:10,80:255,60:255 --overlay cable.mp4",
        "track film.mp4 --hsv 170:10,80:255,60:255 --overlay cable.mp4",
        "track frames --masks a.npz --out a.npz",
        "track frames/*.png --kind mask --overlay frames",
        "detect hard.png --hsv 170:10,80:255,60:255 --overlay soft.png",
        "track frames --config settings.yaml --out settings.jsonl --overlay settings.yaml",
    )
}
