"""Files of ``dloftbs colour``: pictures that are drawn on, settings that are gone on from, the mask as a picture."""

from __future__ import annotations

import os
import shlex
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import click
import cv2
import numpy as np
import numpy.typing as npt

from dloftbs import sources, viz
from dloftbs.cli.places import InputFiles
from dloftbs.config import ColourConfig, Config, Stroke
from dloftbs.data.frame import Frame
from dloftbs.errors import InputError, SinkError, SourceError
from dloftbs.sinks.sink import identity_of
from dloftbs.sources.video import without_password
from dloftbs.support.documents import parse_yaml, read_text
from dloftbs.support.safe_files import sink_errors
from dloftbs.support.text import readable

_CYAN = np.array([255.0, 230.0, 0.0])
_TINT = 0.6  # of the mask over the picture
_SIGNATURES = (b"# A colour learned by dloftbs colour",)
_TILE_PX = 960  # of several pictures in one
_PICTURE_SUFFIXES = (".png", ".jpg", ".jpeg", ".bmp", ".tif", ".tiff", ".webp")

Image = npt.NDArray[np.uint8]


def check_places(where: Sequence[str], config_file: Path | None, out: str | None, overlay: str | None) -> None:
    """Let no output take the place of an input, of the other output, or of a file of somebody else.

    Raises
    ------
    click.UsageError
        If one would.
    SinkError
        If there are settings in the place of --out that this command did not write.
    """
    inputs = InputFiles(where, {"config_file": config_file})
    for option, path in {"--out": out, "--overlay": overlay}.items():
        if path is not None and (replaced := inputs.name_of(identity_of(path))):
            raise click.UsageError(f"{option} {path} would replace the input {replaced}; choose another name")
    if out is not None and overlay is not None and identity_of(out) == identity_of(overlay):
        raise click.UsageError(f"--out {out} and --overlay {overlay} are the same place; choose two")
    if out is not None and os.path.isfile(out):
        with sink_errors(Path(out)), open(out, "rb") as file:
            if not file.read(100).startswith(_SIGNATURES):
                raise SinkError(f"{out} is there and not by dloftbs colour: it is not replaced; choose another name")


def stated_settings(file: Path | None) -> tuple[dict[str, Any], ColourConfig | None]:
    """Return what a file of settings states, and its colour.

    Raises
    ------
    ConfigError
        If it cannot be read.
    """
    if file is None:
        return {}, None
    colour = Config.from_file(file).segmentation.colour
    (sections,) = parse_yaml(read_text(file)) or ({},)
    return sections, colour


def read_frame(where: str, index: int, topics: Mapping[str, str | None]) -> Frame:
    """Return a frame of a source, which has an image; `topics` are arguments of `sources.open`.

    Raises
    ------
    SourceError, InputError
        If it cannot be read, or is a mask.
    """
    topic, depth_topic, info_topic = (topics[name] for name in ("topic", "depth_topic", "info_topic"))
    with sources.open(where, kind="image", topic=topic, depth_topic=depth_topic, info_topic=info_topic) as source:
        frame = next((one for one in source if one.index >= index), None)
    if frame is None or frame.index > index:
        raise SourceError(f"{where}: there is no frame {index} that can be read")
    if frame.image is None:
        raise InputError(f"{where} is a mask already, which needs no colour")
    return frame


def source_of(where: str, frame: Frame) -> str:
    """Return where a frame comes from, as the configuration keeps it: without folders, which are nobody's business."""
    name = readable(Path(without_password(where)).name or where)
    return name if name.lower().endswith(_PICTURE_SUFFIXES) else f"{name} frame {frame.index}"


def overlay_of(images: Sequence[Image], masks: Sequence[Image], strokes: Sequence[Sequence[Stroke]]) -> Image:
    """Return the pictures with their masks in cyan, and the strokes: white on cables, black on others."""
    drawn = [_overlay(*one) for one in zip(images, masks, strokes, strict=True)]
    return drawn[0] if len(drawn) == 1 else viz.contact_sheet(drawn, columns=2, tile_width=_TILE_PX)


def _overlay(image: Image, mask: Image, strokes: Sequence[Stroke]) -> Image:
    picture = image.copy()
    found = mask > 0
    picture[found] = ((1.0 - _TINT) * picture[found] + _TINT * _CYAN).round().astype(np.uint8)
    for stroke in strokes:
        points = np.rint(np.array(stroke.points)).astype(np.int32).reshape(-1, 1, 2)
        ink = (255, 255, 255) if stroke.cable else (0, 0, 0)
        cv2.polylines(picture, [points], False, ink, max(1, round(stroke.radius_px)), cv2.LINE_AA)
    return picture


def next_command(where: Sequence[str], out: str | None, topics: Mapping[str, str | None]) -> str:
    """Return the command that uses the colour, and reads a recording by the same topics."""
    settings = "cable.yaml" if out is None else out
    pictures = all(text.lower().endswith(_PICTURE_SUFFIXES) for text in where)
    named = [word for name, topic in topics.items() if topic for word in (f"--{name.replace('_', '-')}", topic)]
    words = ["dloftbs", "detect" if pictures else "track", *where, *named, "--config", settings]
    return shlex.join(
        [*words, "--overlay", ("overlays" if len(where) > 1 else "overlay.png") if pictures else "overlay.mp4"]
    )
