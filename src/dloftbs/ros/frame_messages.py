"""Frames from messages."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from dloftbs.camera import DepthRegistration, PinholeCamera
from dloftbs.data.frame import Frame
from dloftbs.errors import InputError, SourceError
from dloftbs.ros.bag_file import RawMessage
from dloftbs.ros.camera_messages import camera_of
from dloftbs.ros.image_messages import is_from_lossy_codec, pixels_of, upper_bits
from dloftbs.ros.message_fields import NS_PER_S, frame_id_of, is_same_sensor, kind_of_reason, stamp_ns_of
from dloftbs.sources.pixels import GREY_AS_IMAGE, Kind, check_kind, image_or_mask
from dloftbs.sources.source import logger
from dloftbs.support.arrays import AnyArray, check_image, check_mask
from dloftbs.support.values import (
    DEPTH_UNITS_M,
    MILLIMETRE_M,
    check_all,
    check_flag,
    check_integer,
    check_mask_kind,
    check_number,
    check_text,
    check_type,
    set_fields,
    shown,
)

_LARGEST_STAMP_NS = 2**63 - 1

ImageAndMask = tuple[AnyArray | None, AnyArray | None]


@dataclass(frozen=True, eq=False, repr=False)
class RosFrame(Frame):
    """A frame that knows its message's header to the nanosecond, which results are to carry on.

    Parameters
    ----------
    frame_id : str
        Name of the camera's coordinate frame.
    stamp_ns : int, optional
        Time in the header, in nanoseconds; `stamp` has it in seconds, rounded to a float, except where the header does
        not follow the previous one (see `BagSource`).
    recorded : tuple of RawMessage, optional
        Messages of the recording that came since the frame before, whatever their topic; None where they were not kept.

    Raises
    ------
    InputError
        As `Frame`.
    """

    frame_id: str = ""
    stamp_ns: int | None = None
    recorded: tuple[RawMessage, ...] | None = None

    def __post_init__(self) -> None:
        super().__post_init__()
        set_fields(self, frame_id=check_text("frame_id", self.frame_id))
        if self.stamp_ns is not None:
            stamp_ns = check_integer("stamp_ns", self.stamp_ns, -_LARGEST_STAMP_NS, _LARGEST_STAMP_NS)
            set_fields(self, stamp_ns=stamp_ns)
        if self.recorded is not None:
            set_fields(self, recorded=check_all("recorded", self.recorded, RawMessage))


class FrameMaker:
    """Makes frames of the messages of one camera.

    Parameters
    ----------
    where : str
        Origin of the messages, for warnings.
    kind : {"auto", "image", "mask", "auto_image"}
        "auto" takes one channel for a mask, whose values `Frame` reads (`mask_is`); colour is an image. "auto_image"
        takes both for images.
    mask_is : {"auto", "binary", "probability", "labels"}
        What the values of masks are, as `Frame` has it.
    rectified : bool
        Whether the images are rectified (see `camera_of`).
    camera : PinholeCamera, optional
        Takes the place of what messages say.
    registration : DepthRegistration, optional
        Brings the depth into the image; its colour camera is then the frames'.
    depth_unit_m : float
        Metres per count of integer depth.
    depth_is_meant, info_is_meant : bool
        Whether somebody said that they go with the images. If they do not, that is an error; otherwise they are left
        out with one warning.
    depth_is_registered : bool
        Whether depth is known to be in the pixels of the images where messages do not say their coordinate frame. Depth
        or a camera that nobody meant, and that comes in another coordinate frame than the images, is that of another
        sensor, and is left out; depth that was meant is taken, with a warning.

    Raises
    ------
    InputError
        If an argument is of another type or out of range.
    """

    def __init__(
        self,
        where: str,
        *,
        kind: Kind = "auto",
        mask_is: str = "auto",
        rectified: bool = False,
        camera: PinholeCamera | None = None,
        registration: DepthRegistration | None = None,
        depth_unit_m: float = MILLIMETRE_M,
        depth_is_meant: bool = True,
        info_is_meant: bool = True,
        depth_is_registered: bool = False,
    ) -> None:
        self._where = check_text("where", where)
        check_kind(kind)
        if camera is not None:
            check_type("camera", camera, PinholeCamera)
        if registration is not None:
            check_type("registration", registration, DepthRegistration)
        self._kind: Kind = "image" if kind == GREY_AS_IMAGE else kind
        self._mask_is = check_mask_kind(mask_is)
        self._rectified = check_flag("rectified", rectified)
        self._camera = camera if registration is None else registration.colour_camera
        self._is_fixed = self._camera is not None
        self._registration = registration
        self._depth_unit_m = check_number("depth_unit_m", depth_unit_m, *DEPTH_UNITS_M)
        self._depth_is_meant = check_flag("depth_is_meant", depth_is_meant)
        self._info_is_meant = check_flag("info_is_meant", info_is_meant)
        self._depth_is_registered = check_flag("depth_is_registered", depth_is_registered)
        self._info_frame = ""
        self._warned: set[str] = set()

    @property
    def knows_camera(self) -> bool:
        """True if the camera was given, or a message had it, or none."""
        return self._is_fixed or self._camera is not None or "camera" in self._warned

    def take_info(self, info: Any) -> None:
        """Take a message of the camera, for the frames from now on.

        Raises
        ------
        InputError
            If it was meant to be that of the images, and cannot be read.
        """
        if self._is_fixed:
            return
        try:
            camera = camera_of(info, rectified=self._rectified)
            self._info_frame = frame_id_of(info)
        except InputError as error:
            if self._info_is_meant:
                raise
            camera = None
            self._warn("camera", f"frames go without a camera: {error}")
        else:
            if camera is None:
                self._warn("camera", "frames go without a camera: it is not calibrated, its matrix K is 0")
        if camera != self._camera:  # the same one keeps what it has computed of its lens
            self._camera = camera

    def pixels(self, image: Any, mask: Any = None) -> ImageAndMask:
        """Return the image, or the mask, of a message; of two messages, the image of the one and the mask of the other.

        Parameters
        ----------
        image : sensor_msgs/Image or sensor_msgs/CompressedImage
        mask : sensor_msgs/Image or sensor_msgs/CompressedImage, optional
            Of the same moment; its values are what `mask_is` says. What comes in `image` is then an image, also with
            one channel.

        Raises
        ------
        InputError
            If one cannot be converted.
        """
        if mask is None:
            return _read(image, self._kind, self._mask_is)
        picture, _ = _read(image, "image", self._mask_is)
        try:
            no_mask, pixels = _read(mask, "auto", self._mask_is)
        except InputError as error:
            raise InputError(f"its mask: {error}") from error
        if no_mask is not None:
            raise InputError(f"its mask must have one channel, got {no_mask.shape}")
        return picture, pixels

    def make(
        self,
        image: Any,
        pixels: ImageAndMask,
        depth: Any = None,
        *,
        index: int = 0,
        stamp: float | None = None,
        stamp_ns: int | None = None,
        name: str = "",
        recorded: tuple[RawMessage, ...] | None = None,
    ) -> RosFrame:
        """Return a frame.

        Parameters
        ----------
        image : sensor_msgs/Image or sensor_msgs/CompressedImage
        pixels : (array or None, array or None)
            As `pixels` gave them.
        depth : sensor_msgs/Image or sensor_msgs/CompressedImage, optional
            A message that cannot be converted is left out with a warning.
        index, name, recorded
            As `RosFrame` has them.
        stamp : float, optional
            Time in seconds in place of the message's.
        stamp_ns : int, optional
            Time in nanoseconds where the message says none.

        Raises
        ------
        InputError
            If depth or camera do not go with the image, and were meant to, or an argument is of another type.
        """
        size = _size_of(pixels)
        own_ns = stamp_ns_of(image)
        stamp_ns = stamp_ns if own_ns is None else own_ns
        if stamp is None and stamp_ns is not None:
            stamp = stamp_ns / NS_PER_S
        return RosFrame(
            *pixels,
            None if depth is None else self._depth(depth, image, size),
            camera=self._fitting_camera(size, frame_id_of(image)),
            index=index,
            stamp=stamp,
            name=name,
            depth_unit_m=self._depth_unit_m,
            mask_is=self._mask_is,
            frame_id=frame_id_of(image),
            stamp_ns=stamp_ns,
            recorded=recorded,
        )

    def _depth(self, message: Any, image: Any, size: tuple[int, int]) -> AnyArray | None:
        try:
            frames = frame_id_of(message), frame_id_of(image)
            same = is_same_sensor(*frames)
            if same is None:
                same = self._depth_is_registered or not any(frames)
            if self._registration is None and not same:
                why = f"it is in the frame {frames[0]!r}, the images are in {frames[1]!r}"
                if not self._depth_is_meant:
                    self._warn("depth", f"frames go without depth, which is not registered to the images: {why}")
                    return None
                self._warn("depth", f"depth is taken for registered to the images, as its topic was named, but {why}")
            depth = pixels_of(message)
            if depth.ndim != 2 or depth.dtype == np.uint8:
                raise InputError(f"it must have one channel of more than 8 bits, got {depth.shape} of {depth.dtype}")
        except InputError as error:
            self._warn(
                f"depth {kind_of_reason(error)}", f"a frame goes without depth, and others for this reason: {error}"
            )
            return None
        if self._registration is not None:
            return self._registration.register(depth, size)
        if depth.shape != size and not self._depth_is_meant:
            why = f"{depth.shape} where the images have {size} (rows, columns); it needs a registration"
            self._warn("depth", f"frames go without depth, which has another size: {why}")
            return None
        return depth

    def _fitting_camera(self, size: tuple[int, int], frame_id: str) -> PinholeCamera | None:
        camera = self._camera
        if camera is None or self._is_fixed or self._info_is_meant:
            return camera
        if is_same_sensor(self._info_frame, frame_id) is False:
            why = f"it is in the frame {self._info_frame!r}, the images are in {frame_id!r}"
        elif camera.size not in (None, size):
            why = f"it is for images of {camera.size}, got {size}"
        else:
            return camera
        self._warn("camera", f"frames go without a camera: {why}; --camera (camera=) gives one")
        return None

    def _warn(self, what: str, text: str) -> None:
        if what not in self._warned:
            self._warned.add(what)
            logger.warning("%s: %s", self._where, text)


def _read(message: Any, kind: Kind, mask_is: str) -> ImageAndMask:
    """Return the image or the mask of a message."""
    pixels = pixels_of(message)
    if kind == "image":
        pixels = upper_bits(pixels)
    if kind == "auto":
        kind = "mask" if pixels.ndim == 2 else "image"
    try:
        return image_or_mask(pixels, kind, mask_is, lossy=is_from_lossy_codec(message))
    except SourceError as error:
        raise InputError(str(error)) from error


def _size_of(pixels: ImageAndMask) -> tuple[int, int]:
    """Return the size (H, W) of an image or a mask.

    Raises
    ------
    InputError
        If it is neither.
    """
    if isinstance(pixels, tuple) and len(pixels) == 2:
        image, mask = pixels
        if image is not None:
            return check_image(image).shape[:2]
        if mask is not None:
            return check_mask(mask).shape[:2]
    raise InputError(f"pixels must be an image and a mask, or one of the two and None, got {shown(pixels)}")
