"""Depth, masks, occluders and instances from files beside the colour, frame by frame."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Literal, Protocol

import numpy as np

from dloftbs.camera import DepthRegistration
from dloftbs.data.frame import Frame
from dloftbs.data.instance_labels import Size
from dloftbs.errors import InputError, SourceError, source_errors
from dloftbs.sources.animations import open_animation
from dloftbs.sources.image_files import IMAGE_EXTENSIONS, check_place, is_glob, is_image_file, list_files
from dloftbs.sources.naming_rules import STEM, is_pattern, is_rule, partner_of, partners_in_folder
from dloftbs.sources.npz_members import NpzMember, read_whole
from dloftbs.sources.object_files import Read, holds_objects, object_reads
from dloftbs.sources.partner_stream import StreamPartner
from dloftbs.sources.pixel_values import read_depth, read_labels, read_mask
from dloftbs.sources.pixels import load_npy
from dloftbs.sources.source import Source, logger
from dloftbs.sources.stacks import STACK_EXTENSIONS, Stack, check_stack
from dloftbs.sources.tiff_stack import open_pages
from dloftbs.sources.unreadable import check_format
from dloftbs.sources.video import VideoSource
from dloftbs.support.arrays import AnyArray
from dloftbs.support.values import MILLIMETRE_M

What = Literal["depth", "mask", "occluders", "instances"]
"""Values that go with a frame, by the names of its fields."""

_STACK_KEYS: dict[What, str] = {"depth": "depth", "mask": "masks", "occluders": "occluders", "instances": "instances"}


class Partner(Protocol):
    """Depth, masks, occluders or instances that go with a stream, frame by frame.

    Attributes
    ----------
    count : int or None
        Number of them; None as long as only reading on can show it.
    """

    count: int | None

    def start(self) -> Partner:
        """Return it for one iteration, with indices that grow."""

    def read(self, index: int, size: Size) -> AnyArray | None:
        """Return what goes with the frame (H, W) of a size, or None where it is missing, which is reported."""

    def counted(self) -> int:
        """Return the number of them, after reading to the end where that is needed."""

    def close(self) -> None:
        """Let go of files."""


class _Files:
    def __init__(self, what: What, reads: Sequence[Callable[[Size], AnyArray]]) -> None:
        self.count: int | None = len(reads)
        self._what = what
        self._reads = reads

    def start(self) -> Partner:
        return self

    def read(self, index: int, size: Size) -> AnyArray | None:
        try:
            return self._reads[index](size)
        except SourceError as error:
            logger.warning("frame %d goes without %s: %s", index, self._what, error)
            return None

    def counted(self) -> int:
        return len(self._reads)

    def close(self) -> None:
        """There is nothing open between two reads."""


class _Stacked:
    def __init__(self, stack: Stack) -> None:
        self.count: int | None = int(stack.shape[0])
        self._number = int(stack.shape[0])
        self._stack: Stack | None = stack

    def start(self) -> Partner:
        return self

    def read(self, index: int, size: Size) -> AnyArray | None:
        return None if self._stack is None else self._stack[index]

    def counted(self) -> int:
        return self._number

    def close(self) -> None:
        _close(self._stack)
        self._stack = None


def _close(stack: Stack | None) -> None:
    if isinstance(stack, NpzMember):
        stack.close()


class PairedSource(Source):
    """Frames of a source, with what goes with them; what the source itself brings of the kind is replaced.

    Parameters
    ----------
    source : Source
        Belongs to this one from now on, and is closed with it.
    partners : dict of {"depth", "mask", "occluders", "instances"} to Partner
    registration : DepthRegistration, optional
        Brings the depth into the images.
    depth_unit_m : float
        Metres per count of integer depth.

    Raises
    ------
    SourceError
        If there are more or fewer of them than frames; where only reading shows the number, there is a warning.
    """

    def __init__(
        self,
        source: Source,
        partners: dict[What, Partner],
        registration: DepthRegistration | None = None,
        depth_unit_m: float = MILLIMETRE_M,
    ) -> None:
        self.name, self.fps, self.length = source.name, source.fps, source.length
        self.length_is_estimate = source.length_is_estimate
        self._source = source
        self._partners = partners
        self._registration = registration
        self._depth_unit_m = depth_unit_m
        for what, partner in partners.items():
            if None not in (source.exact_length, partner.count) and source.exact_length != partner.count:
                raise SourceError(_mismatch(what, self.name, source.exact_length, partner.count))

    def __iter__(self) -> Iterator[Frame]:
        """Yield the frames. One of which a partner is missing or cannot be read goes without that.

        Raises
        ------
        InputError
            If depth has another size than its frame and there is no registration, or not the size of its camera.
        SourceError
            As the source itself, and if a stack turns out to be corrupt.
        """
        self._begin()
        return self._frames(iter(self._source))

    def close(self) -> None:
        """Close the source and what goes with it."""
        super().close()
        self._source.close()
        for partner in self._partners.values():
            partner.close()

    def _frames(self, frames: Iterator[Frame]) -> Iterator[Frame]:
        count = 0
        short: set[What] = set()
        partners = {what: partner.start() for what, partner in self._partners.items()}
        try:
            for frame in frames:
                count += 1
                self.skipped = self._source.skipped
                paired = replace(frame, depth_unit_m=self._depth_unit_m) if "depth" in self._partners else frame
                for what, partner in partners.items():
                    paired = _with(paired, what, partner, self._registration if what == "depth" else None, short)
                yield paired
        finally:
            self.skipped = self._source.skipped
        if not self._closed:
            self._check_counts(count + self.skipped, partners)

    def _check_counts(self, count: int, partners: dict[What, Partner]) -> None:
        """Report a partner of another length than the stream, whose frames were not counted before."""
        for what, partner in partners.items():
            number = partner.counted()
            if number != count:
                logger.warning("%s", _mismatch(what, self.name, count, number))
                self.skipped += max(number - count, 0)


def _mismatch(what: What, name: str, expected: int | None, got: int | None) -> str:
    return f"{what} must have as many frames as {name}, which has {expected}; got {got}"


def _with(
    frame: Frame, what: What, partner: Partner, registration: DepthRegistration | None, short: set[What]
) -> Frame:
    without = _give(frame, what, None)
    try:
        array = partner.read(frame.index, frame.size) if partner.count is None or frame.index < partner.count else None
        if array is None:
            if partner.count is not None and frame.index >= partner.count and what not in short:
                logger.warning("frame %d goes without %s: there are only %d", frame.index, what, partner.count)
                short.add(what)
            return without
        if registration is not None:
            array = registration.register(array, frame.size)
        return _give(frame, what, array)
    except InputError as error:
        if what == "depth":  # another size is no fault of one file
            raise InputError(f"{frame.name}: {error}") from error
        logger.warning("frame %d goes without %s: %s", frame.index, what, error)
        return without


def _give(frame: Frame, what: What, array: AnyArray | None) -> Frame:
    match what:
        case "depth":
            return replace(frame, depth=array)
        case "mask":
            return replace(frame, mask=array)
        case "occluders":
            return replace(frame, occluders=array)
        case "instances":
            is_their_mask = (
                frame.mask_is != "labels"
                and frame.instances is not None
                and np.array_equal(frame.mask != 0, frame.instances != 0)
            )
            return replace(frame, instances=array, mask=None if is_their_mask and array is not None else frame.mask)


def open_partner(what: What, where: str, beside: Sequence[Path] | None, mask_is: str = "auto") -> Partner:
    """Open depth, masks, occluders or instances.

    Parameters
    ----------
    what : {"depth", "mask", "occluders", "instances"}
    where : str
        A naming rule such as ``"{stem}_depth.png"``, relative to the folder of each colour file; a folder or a glob
        (see `partners_in_folder`); an image file, of several pages if it is a TIFF; a .npy file (N, H, W) or (H, W); a
        .npz file with the array "depth", "masks", "occluders" or "instances"; a video, for depth with one channel of 16
        bits, for masks and occluders also an animation. For all but depth also a rule with wildcards, and files of
        annotations (`object_reads`).
    beside : sequence of Path or None
        The colour files, None where the source is something else.
    mask_is : {"auto", "binary", "probability", "labels"}
        What the values of masks are, as `Frame` has it; those of occluders are always "auto".

    Raises
    ------
    InputError
        If a naming rule is given for a source that is not made of files, or one of depth has wildcards.
    SourceError
        If there is nothing there, or it cannot be read.
    """
    if what == "occluders":
        mask_is = "auto"
    if what != "depth" and (holds_objects(where) or (what == "instances" and is_rule(where))):
        reads = object_reads(where, beside)
        return _Files(what, reads if what == "instances" else [partial(_union, read) for read in reads])
    if is_pattern(where):
        raise InputError(f"{what}: the rule {where!r} must name one file for a frame, without * ? [")
    if is_rule(where):
        if beside is None:
            raise InputError(f"{what}: the naming rule {where!r} needs colour frames in files of their own")
        return _files(what, [partner_of(path, where) for path in beside], mask_is)
    path = Path(os.path.expanduser(where))
    if is_glob(str(path)) or os.path.isdir(path):
        files = list_files(str(path), (*IMAGE_EXTENSIONS, ".pfm", ".npy"))
        return _files(what, files if beside is None else partners_in_folder(beside, files, where), mask_is)
    return _open_file(what, where, path, mask_is)


def _open_file(what: What, where: str, path: Path, mask_is: str) -> Partner:
    """Open one file."""
    check_place(path, f"{what}: there is no file or folder {where!r}, and it is no naming rule with {STEM}")
    if path.suffix.lower() in STACK_EXTENSIONS:
        return _Stacked(_open_stack(path, _STACK_KEYS[what]))
    pages = open_pages(path, kind="mask", mask_is=mask_is)
    if pages is not None:
        read = pages.read_depth if what == "depth" else pages.read_mask
        return _Files(what, [partial(_of_any_size, partial(read, page)) for page in range(pages.count)])
    check_format(path)
    if what == "instances" and not is_image_file(path):
        raise SourceError(f"{path}: instances must be image files, annotations, .npy or .npz, not a video")
    animation = open_animation(path, kind="mask", mask_is=mask_is)
    if animation is None and is_image_file(path):
        return _files(what, [path], mask_is)
    video = animation or VideoSource(path, kind="mask", mask_is=mask_is)
    if what == "depth" and not (isinstance(video, VideoSource) and video.holds_counts):
        video.close()
        raise SourceError(
            f"{path}: depth in a video must have one channel of 16 bits (gray16le, as FFV1 keeps it); it may also be a "
            "folder or a naming rule of images, a TIFF of several pages, .npy or .npz"
        )
    return StreamPartner(what, video)


def _files(what: What, paths: Sequence[Path | None], mask_is: str) -> _Files:
    return _Files(what, [partial(_of_any_size, partial(_read_file, what, path, mask_is)) for path in paths])


def _read_file(what: What, path: Path | None, mask_is: str = "auto") -> AnyArray:
    """Return what a file holds; None stands for one that is missing in a folder."""
    if path is None:
        raise SourceError("no file of the folder has its name")
    match what:
        case "depth":
            return read_depth(path)
        case "instances":
            return read_labels(path)
        case "mask" | "occluders":
            return read_mask(path, mask_is)


def _of_any_size(read: Callable[[], AnyArray], _size: Size) -> AnyArray:
    """Return what a file holds that says its size."""
    return read()


def _union(read: Read, size: Size) -> AnyArray:
    """Return the mask (H, W) of all objects together."""
    return read(size) != 0


def read_partner(what: What, path: Path) -> AnyArray:
    """Read depth, a mask, occluders or labels (H, W) from an image file, or from a .npy or .npz file with one frame.

    Raises
    ------
    SourceError
        If the file cannot be read, or holds something else or several frames.
    """
    check_place(path, f"{what}: there is no file {str(path)!r}")
    if path.suffix.lower() not in STACK_EXTENSIONS:
        return _read_file(what, path)
    stack = _open_stack(path, _STACK_KEYS[what])
    try:
        array = stack[0] if stack.shape[0] == 1 else None
    finally:
        _close(stack)
    if array is None:
        raise SourceError(f"{path}: {what} must hold one frame, got {stack.shape[0]}")
    return array


def _open_stack(path: Path, key: str) -> Stack:
    if path.suffix.lower() == ".npy":
        array = load_npy(path)
        stack: Stack = array[None] if array.ndim == 2 or (array.ndim == 3 and array.shape[2] == 1) else array
    else:
        keys, _ = read_whole(path, ())
        if key not in keys:
            raise SourceError(f"{path}: needs the array {key!r}; found {', '.join(keys) or 'none'}")
        stack = NpzMember(path, key)
    with source_errors(path, InputError):
        check_stack(key, stack)
    return stack
