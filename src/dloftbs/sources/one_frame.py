"""One frame out of files: a picture, and what goes with it."""

from __future__ import annotations

import os
from itertools import islice
from pathlib import Path

from dloftbs import sources
from dloftbs.data.frame import Frame
from dloftbs.data.instance_labels import Size
from dloftbs.errors import InputError, SourceError
from dloftbs.sources.image_files import FileSource, without_scheme
from dloftbs.sources.naming_rules import is_rule, partner_of
from dloftbs.sources.object_files import object_reads
from dloftbs.sources.pairing import What, read_partner
from dloftbs.sources.pixels import Kind
from dloftbs.sources.standard_input import STANDARD_INPUT
from dloftbs.support.arrays import AnyArray
from dloftbs.support.values import shown


def read_frame(
    where: str | os.PathLike[str], kind: Kind = "auto", mask_is: str = "auto", *, as_stored: bool = False
) -> Frame:
    """Read the frame of a file that holds one, as `sources.open` does: `as_stored`, if a camera or depth goes with it.

    Raises
    ------
    InputError
        If it is a stream: a camera, a folder, or a file with several frames.
    SourceError
        If there is no such file, or it cannot be read.
    """
    text = without_scheme(os.fsdecode(where))
    remedy = f"track({shown(text)}) follows a stream, and sources.open reads it frame by frame"
    if text != STANDARD_INPUT and not os.path.isfile(os.path.expanduser(text)):
        if os.path.exists(os.path.expanduser(text)) or "://" in text or text.isdecimal():
            raise InputError(f"expected the file of one picture, got {shown(text)}; {remedy}")
        raise SourceError(f"there is no file {shown(text)}")
    source = sources.open(text if text == STANDARD_INPUT else Path(text), kind=kind, mask_is=mask_is)
    if as_stored and isinstance(source, FileSource):
        source = FileSource(source.paths, source.name, kind=kind, mask_is=mask_is)
    with source:
        frames = list(islice(source, 2))
    if len(frames) > 1:
        raise InputError(f"expected the file of one picture, and {shown(text)} holds several; {remedy}")
    if not frames:
        raise SourceError(f"{text} holds no frame that can be read")
    return frames[0]


def read_beside(what: What, where: str | os.PathLike[str], picture: object) -> AnyArray:
    """Read depth, a mask or occluders that go with one picture.

    Parameters
    ----------
    what : {"depth", "mask", "occluders"}
    where : str or path
        A file, or a naming rule such as ``"{stem}_depth.png"``, relative to the folder of the picture.
    picture : object
        Where the picture comes from; a path if there is a naming rule.

    Raises
    ------
    InputError
        If there is a naming rule, and the picture has no path.
    SourceError
        If the file cannot be read, or holds something else.
    """
    text = os.fsdecode(where)
    if is_rule(text):
        if not isinstance(picture, (str, os.PathLike)):
            raise InputError(f"{what}: the naming rule {text!r} needs the path of a picture, got {shown(picture)}")
        return read_partner(what, partner_of(Path(os.path.expanduser(os.fsdecode(picture))), text))
    return read_partner(what, Path(os.path.expanduser(text)))


def read_instances(where: str | os.PathLike[str], picture: object, size: Size | None) -> AnyArray:
    """Read the label image (H, W) of the objects in one frame.

    Parameters
    ----------
    where : str or path
        A file, or a naming rule, as `sources.open` takes them.
    picture : object
        As of `read_beside`.
    size : (int, int) or None
        ``(H, W)`` of the frame, where it is known.

    Raises
    ------
    InputError, SourceError
        As `read_beside`.
    """
    path = Path(os.path.expanduser(os.fsdecode(picture))) if isinstance(picture, (str, os.PathLike)) else None
    (read,) = object_reads(os.fsdecode(where), None if path is None else [path])
    return read(size)
