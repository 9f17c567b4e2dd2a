"""Sources of frames: image files, folders, videos, cameras, streams, arrays, recordings of ROS.

>>> with dloftbs.sources.open("frames/", depth="{stem}_depth.png") as source:  # doctest: +SKIP
...     for frame in source:
...         print(frame.index, frame.name, frame.size)

Frames are read one at a time. What cannot be read is skipped with a warning of the logger ``dloftbs.sources``, leaves a
hole in the indices, and is counted in `Source.skipped`.
"""

from __future__ import annotations

import os
import re
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple, cast

import numpy as np
import numpy.typing as npt

from dloftbs.camera import CameraLike, DepthRegistration, PinholeCamera, as_camera
from dloftbs.errors import DloftbsError, InputError, SourceError
from dloftbs.sources.animations import AnimationSource, open_animation
from dloftbs.sources.cameras import camera_index
from dloftbs.sources.image_files import (
    IMAGE_EXTENSIONS,
    FileSource,
    check_place,
    is_glob,
    is_image_file,
    list_files,
    without_scheme,
)
from dloftbs.sources.look_alikes import warn_of_labels, without_drawn
from dloftbs.sources.naming_rules import is_rule, without_partners
from dloftbs.sources.object_files import ObjectFileSource, group_by_frame
from dloftbs.sources.pairing import PairedSource, What, open_partner
from dloftbs.sources.pixels import Kind, check_kind
from dloftbs.sources.recordings import is_recording
from dloftbs.sources.source import Source
from dloftbs.sources.stacks import STACK_EXTENSIONS, ArraySource, from_array, from_file
from dloftbs.sources.standard_input import STANDARD_INPUT, open_standard_input
from dloftbs.sources.tiff_stack import PageSource, open_pages
from dloftbs.sources.unreadable import check_format
from dloftbs.sources.video import LiveSource, VideoSource
from dloftbs.support.array_likes import as_pixels, is_array_like
from dloftbs.support.values import (
    DEPTH_UNITS_M,
    MILLIMETRE_M,
    as_float,
    check_flag,
    check_mask_kind,
    check_number,
    check_path,
    shown,
)

__all__ = [
    "AnimationSource",
    "ArraySource",
    "FileSource",
    "LiveSource",
    "PageSource",
    "PairedSource",
    "Source",
    "VideoSource",
    "Where",
    "open",
]

MAX_CAMERA_DIGITS = 9
"""OpenCV takes 32-bit integers as indices of cameras."""

PathLike = str | os.PathLike[str]
Where = PathLike | int | npt.NDArray[Any] | Sequence[PathLike]
"""Places that `open` opens."""


def open(
    where: Where,
    *,
    kind: Kind = "auto",
    mask_is: str = "auto",
    depth: PathLike | None = None,
    masks: PathLike | None = None,
    occluders: PathLike | None = None,
    instances: PathLike | None = None,
    camera: CameraLike | None = None,
    registration: DepthRegistration | PathLike | None = None,
    depth_unit_m: float | None = None,
    fps: float | None = None,
    jobs: int = 1,
    topic: str | None = None,
    depth_topic: str | None = None,
    info_topic: str | None = None,
    mask_topic: str | None = None,
    keep_messages: bool = False,
) -> Source:
    """Open whatever frames come from.

    Parameters
    ----------
    where : str, path, int, numpy.ndarray or sequence of paths
        An image file, a folder or a glob of such (in natural order: img2 before img10), an animated PNG, WebP, AVIF or
        a TIFF of several pages by itself, a video file, a .npy or .npz file, the address of a stream
        (``"rtsp://..."``), the index of a camera (0, ``"0"``) or its device (``"/dev/video0"``). ``"-"`` is an image,
        an animation, a TIFF, a .npy or a .npz file on standard input, which is read into memory as a whole. An array,
        of whatever library, is a stack of images (N, H, W, 3), uint8, BGR, or of masks (N, H, W), (N, 1, H, W) or
        (N, H, W, 1), bool, integer or a probability in 0..1. A .npz holds `images`, `masks` or `instances`, and may
        hold `depth` and `occluders` (N, H, W), `stamps` (N,) in seconds and `camera` (4,) = fx, fy, cx, cy, the latter
        with `distortion` and `distortion_model` as `PinholeCamera` has them.
    kind : {"auto", "image", "mask", "auto_image"}
        Kind of the frames. "auto": image files with one channel, or with equal channels, are masks, whose values
        `Frame` reads (`mask_is`); other files, videos, animations and cameras are images; arrays are what their shape
        or key says. In PNG files of indexed colour that are masks, index 0 is ground, any other cable, whatever their
        colours; with "auto" they are masks if index 0 is black and the most frequent of at most 32 in the image, as
        labels have it, or if all colours are grey. "auto_image": as "auto", but files and arrays of one channel are
        images too, for frames whose masks a colour is to make; arrays of bool, and `masks` in a .npz file, stay masks.
    mask_is : {"auto", "binary", "probability", "labels"}
        What the values of masks are, as `Frame` has it; occluders are always "auto". In masks from JPEG, AVIF, lossy
        WebP and most videos, cable begins at half brightness, since their codecs ring around edges. Only a
        "probability" keeps its values there, and "labels" are refused.
    depth : str or path, optional
        Depth registered to the frames: a folder, a glob, a .npy or a .npz file (key `depth`) or a TIFF with as many
        frames, or a video of one channel of 16 bits; or a naming rule such as ``"{stem}_depth.png"`` or
        ``"../depth/{stem}.npy"``, relative to the folder of each colour file. Files are 16-bit or floating-point
        images, or .npy (H, W). Where one is missing or cannot be read, there is a warning, and the frame goes without.
        Files of a folder go with image files by name if most stems agree, and otherwise by order.
    masks : str or path, optional
        Masks to go with images, in the same ways, or as any video or animation; the key in a .npz file is `masks`.
    occluders : str or path, optional
        Masks of what may hide cables, in the same ways as `masks` (see `Frame`); the key in a .npz file is `occluders`.
    instances : str or path, optional
        A mask per object (see `Frame`): label images in the same ways as `masks`, but for videos; a rule with wildcards
        such as ``"{stem}_mask_*.png"``, a file per object, numbered from 1 in natural order, but for one whose stem
        ends in ``_all``; ``"{stem}.json"`` of labelme or SAM; ``"{stem}.txt"`` of YOLO; or one file of COCO, whose
        ``file_name`` are those of the frames. The latter four are taken as `masks`, too. In a folder without pictures,
        the rule's stems are the frames.
    camera : PinholeCamera, str or path, or array_like, optional
        Goes with every frame, in place of what a .npz file says; a file as `PinholeCamera.from_file` reads it, the
        matrix K (3, 3), or (fx, fy, cx, cy). Beside a camera, depth, masks or occluders, image files are read as
        stored; alone, turned as their EXIF orientation says.
    registration : DepthRegistration, str or path, optional
        The depth is that of a camera of its own, of any size: it is brought into the pixels of the images, whose camera
        is that of the registration. A file as `DepthRegistration.from_file` reads it.
    depth_unit_m : float, optional
        Metres per count of integer depth; by default the registration's, or 0.001: millimetres.
    fps : float, optional
        Frames per second: the stamps are then ``index / fps``. Without it, files and arrays have no stamps of their own
        (a .npz file may), and videos have those of the stream, counted from its first frame. Cameras and live streams
        take none.
    jobs : int
        Image files decoded at the same time, in threads, ahead of the frame that is asked for; with 1, each is decoded
        when it is. Makes no difference to videos, cameras, stacks and recordings.
    topic, depth_topic, info_topic : str, optional
        Topics of a recording: images, depth registered to them, and their camera. Depth and camera are matched to the
        images where they are left out, and so are images if there is one choice; several are listed in the error.
    mask_topic : str, optional
        Topic of the masks of a recording's images, paired with them by stamp, as a segmenter publishes them. Images
        without a mask are left out. A recording of masks alone is read by `topic`, with `kind="mask"`.
    keep_messages : bool
        Frames of a recording of ROS 2 carry the messages of all of its topics, for a `dloftbs.ros.BagSink` that copies
        its input. Makes no difference to other frames.

    Returns
    -------
    Source
        To be iterated over and closed. All but cameras and streams can be iterated over again.

    Raises
    ------
    InputError
        If an argument is of a wrong type or value.
    SourceError
        If there is nothing there, it cannot be opened, or depth, masks or occluders differ from the frames in number;
        where a video has to be read to count its frames, there is a warning at its end.
    """
    _check_options(kind, mask_is, masks, fps, jobs)
    check_flag("keep_messages", keep_messages)
    _check_paths(where, depth, masks, occluders, instances)
    camera, registration = _cameras(camera, registration)
    if depth_unit_m is None:
        depth_unit_m = MILLIMETRE_M if registration is None else registration.depth_unit_m
    elif registration is not None:
        registration = replace(registration, depth_unit_m=depth_unit_m)
    depth_unit_m = check_number("depth_unit_m", depth_unit_m, *DEPTH_UNITS_M)
    if masks is not None:
        if mask_topic is not None:
            raise InputError("masks and mask_topic are two sources of masks; leave out one")
        kind = "image"
    paired: dict[What, str] = {}
    for what, partner in (("depth", depth), ("mask", masks), ("occluders", occluders), ("instances", instances)):
        if partner is not None:
            paired[cast(What, what)] = _path_text(what, partner)
    where = as_pixels("where", where, "any") if is_array_like(where) else where
    where = without_scheme(where) if isinstance(where, str) else where
    live = _live_address(where)
    if live is not None:
        given = [*paired, *(["registration"] if registration else [])]
        if given:
            raise InputError(f"{' and '.join(given)} cannot go with a camera or a stream")
        return LiveSource(live, kind=kind, mask_is=mask_is, camera=camera, fps=fps)
    rules: dict[What, str] = {what: text for what, text in paired.items() if is_rule(text)}
    # Depth of its own replaces that of a stack.
    own_registration = None if depth is not None else registration
    topics = {"topic": topic, "depth_topic": depth_topic, "info_topic": info_topic, "mask_topic": mask_topic}
    recording = _recording(where, topics)
    if recording is None:
        upright = camera is None and not paired  # all that stands beside a picture is for its pixels as stored
        opening = _Opening(kind, mask_is, camera, fps, rules, own_registration, depth_unit_m, jobs, upright)
        source = _open_recorded(where, opening)
    else:
        from dloftbs.ros import BagSource

        source = BagSource(
            recording,
            topic=topic,
            depth_topic=depth_topic,
            info_topic=info_topic,
            mask_topic=mask_topic,
            kind=kind,
            mask_is=mask_is,
            camera=camera,
            registration=own_registration,
            depth_unit_m=depth_unit_m,
            fps=fps,
            guess_depth=depth is None,
            keep_messages=keep_messages,
        )
    if registration is not None and depth is None and not source.has_depth:
        source.close()
        raise InputError("a registration needs depth to be registered; there is none")
    return _pair(source, paired, mask_is, registration, depth_unit_m) if paired else source


class _Opening(NamedTuple):
    """Arguments of `open` for frames in files and arrays, checked."""

    kind: Kind
    mask_is: str
    camera: PinholeCamera | None
    fps: float | None
    rules: dict[What, str]
    registration: DepthRegistration | None
    depth_unit_m: float
    jobs: int
    upright: bool


def _recording(where: Where, topics: dict[str, str | None]) -> Path | None:
    """Return the path of a recording of ROS; None where this is something else, which has no topics."""
    if isinstance(where, (str, os.PathLike)):
        path = Path(os.path.expanduser(where))
        if is_recording(path):
            return path
    named = [name for name, text in topics.items() if text is not None]
    if named:
        raise InputError(f"{' and '.join(named)}: only recordings of ROS have topics, and {shown(where)} is none")
    return None


def _cameras(
    camera: CameraLike | None, registration: DepthRegistration | PathLike | None
) -> tuple[PinholeCamera | None, DepthRegistration | None]:
    if isinstance(camera, (str, os.PathLike)):
        check_path("camera", camera)
    camera = None if camera is None else as_camera(camera)
    if isinstance(registration, (str, os.PathLike)):
        registration = DepthRegistration.from_file(os.path.expanduser(check_path("registration", registration)))
    if registration is None:
        return camera, None
    if not isinstance(registration, DepthRegistration):
        raise InputError(f"registration must be a DepthRegistration or the path of a file, got {shown(registration)}")
    if camera not in (None, registration.colour_camera):
        raise InputError("camera and registration name two colour cameras; leave out the camera")
    return registration.colour_camera, registration


def _pair(
    source: Source, paired: dict[What, str], mask_is: str, registration: DepthRegistration | None, depth_unit_m: float
) -> Source:
    if isinstance(source, ObjectFileSource):  # it has read its own
        paired = {what: text for what, text in paired.items() if what != "instances"}
    beside = source.paths if isinstance(source, (FileSource, ObjectFileSource)) else None
    try:
        partners = {what: open_partner(what, text, beside, mask_is) for what, text in paired.items()}
        return PairedSource(source, partners, registration, depth_unit_m)
    except DloftbsError:
        source.close()
        raise


def _open_recorded(where: Where, given: _Opening) -> Source:
    kind, mask_is, camera, fps, _, registration, depth_unit_m, jobs, upright = given
    if isinstance(where, np.ndarray):
        return from_array(where, "array", kind, mask_is, camera, fps)
    if isinstance(where, str) and where == STANDARD_INPUT:
        return open_standard_input(kind, mask_is, camera, fps, registration, depth_unit_m, upright)
    if isinstance(where, (str, os.PathLike)):
        return _open_path(Path(os.path.expanduser(where)), given)
    if not isinstance(where, Sequence) or not all(isinstance(item, (str, os.PathLike)) for item in where) or not where:
        raise InputError(f"where must be a path, a camera's index, an array or a sequence of paths, got {shown(where)}")
    paths = [Path(os.path.expanduser(item)) for item in where]
    for path in paths:
        _check_exists(path)
    name = f"{len(paths)} files"
    return FileSource(paths, name, kind=kind, mask_is=mask_is, camera=camera, fps=fps, jobs=jobs, upright=upright)


def _open_path(path: Path, given: _Opening) -> Source:
    kind, mask_is, camera, fps, _, registration, depth_unit_m, _, upright = given
    if is_glob(str(path)) or os.path.isdir(path):
        return _open_folder(str(path), given)
    _check_exists(path)
    animation = open_animation(path, kind=kind, mask_is=mask_is, camera=camera, fps=fps)
    if animation is not None:
        return animation
    pages = open_pages(path, kind=kind, mask_is=mask_is, camera=camera, fps=fps, upright=upright)
    if pages is not None:
        return pages
    if path.suffix.lower() in STACK_EXTENSIONS:
        return from_file(path, kind, mask_is, camera, fps, registration, depth_unit_m)
    if is_image_file(path):
        return FileSource([path], str(path), kind=kind, mask_is=mask_is, camera=camera, fps=fps, upright=upright)
    check_format(path)
    return VideoSource(path, kind=kind, mask_is=mask_is, camera=camera, fps=fps)


def _open_folder(where: str, given: _Opening) -> Source:
    """Open a folder or a glob."""
    kind, mask_is, camera, fps, rules, _, _, jobs, upright = given
    of_objects = rules.get("instances")
    groups = None if of_objects is None else group_by_frame(where, of_objects, [*rules.values()])
    if of_objects is not None and groups is not None:
        return ObjectFileSource(groups, of_objects, where, mask_is=mask_is, camera=camera, fps=fps)
    paths = without_drawn(list_files(where, IMAGE_EXTENSIONS), where)
    for rule in rules.values():
        paths = without_partners(paths, rule)
    if not paths:
        raise SourceError(f"{where}: every image is the partner of another under {' and '.join(rules.values())}")
    warn_of_labels(paths, where)
    return FileSource(paths, where, kind=kind, mask_is=mask_is, camera=camera, fps=fps, jobs=jobs, upright=upright)


def _check_exists(path: Path) -> None:
    check_place(path, f"there is no file or folder {str(path)!r}")


def _live_address(where: object) -> int | str | None:
    """Return the index of a camera or the address of a stream; None where this is neither."""
    if isinstance(where, (str, os.PathLike)):
        text = os.fspath(where)
        if isinstance(where, str) and re.fullmatch(r"[A-Za-z][A-Za-z0-9+.-]+://.*", text):
            return text
        if not (isinstance(where, str) and re.fullmatch("[0-9]+", text)):
            return camera_index(text)
    elif isinstance(where, (int, np.integer)) and not isinstance(where, bool):
        text = str(where)
    else:
        return None
    if text.startswith("-"):
        raise InputError(f"the index of a camera must be at least 0, got {text}")
    if len(text) > MAX_CAMERA_DIGITS:
        raise InputError(f"the index of a camera must have at most {MAX_CAMERA_DIGITS} digits, got {text}")
    return int(text)


def _check_paths(where: Where, depth: object, masks: object, occluders: object, instances: object) -> None:
    """Refuse what is no path, before anything is opened."""
    beside = {"depth": depth, "masks": masks, "occluders": occluders, "instances": instances}
    for name, path in {"where": where, **beside}.items():
        if isinstance(path, str) and not path:
            raise InputError(f"{name} is an empty text; the current folder is '.'")
        for each in path if isinstance(path, Sequence) and not isinstance(path, (str, bytes)) else [path]:
            if isinstance(each, (str, os.PathLike)):
                check_path(name, each)


def _path_text(what: str, where: object) -> str:
    if not isinstance(where, (str, os.PathLike)):
        raise InputError(f"{what} must be a path or a naming rule, got {shown(where)}")
    return os.fspath(where)


def _check_options(kind: object, mask_is: object, masks: object, fps: object, jobs: object) -> None:
    check_kind(kind)
    check_mask_kind(mask_is)
    if masks is not None and kind == "mask":
        raise InputError("kind must be 'image' where masks are given, got 'mask'")
    rate = as_float(fps)
    if fps is not None and (rate is None or rate <= 0.0):
        raise InputError(f"fps must be a positive number, got {shown(fps)}")
    if isinstance(jobs, bool) or not isinstance(jobs, int) or jobs < 1:
        raise InputError(f"jobs must be an integer of at least 1, got {shown(jobs)}")
