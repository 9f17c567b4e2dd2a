"""Input of the pipeline: one moment of a stream."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from dloftbs.camera import PinholeCamera, as_camera
from dloftbs.errors import InputError
from dloftbs.support.array_likes import NONE_IS, as_pixels
from dloftbs.support.arrays import AnyArray, check_depth, check_image, check_mask, looks_like_image, plane_of
from dloftbs.support.mask_values import as_probability
from dloftbs.support.values import (
    DEPTH_UNITS_M,
    MAX_WHOLE,
    MILLIMETRE_M,
    check_integer,
    check_mask_kind,
    check_number,
    check_stamp,
    check_text,
    set_fields,
)

_REGISTER = (
    "; depth of a camera of its own must be registered to the image first: DepthRegistration.register, "
    "or registration= of sources.open, or --registration"
)


@dataclass(frozen=True, eq=False, repr=False)
class Frame:
    """One moment of a stream. The arrays are held as read-only views, not copied.

    Parameters
    ----------
    image : numpy.ndarray, shape (H, W, 3), uint8, optional
        Colour image in OpenCV's order, BGR.
    mask : numpy.ndarray, shape (H, W) or (H, W, 1), bool, any integer type, or floating point in 0..1, optional
        Where it is given, no segmentation takes place.
    depth : numpy.ndarray, shape (H, W) or (H, W, 1), floating point or integer, optional
        Registered to the image: metres where floating point, counts of `depth_unit_m` where integer. Depth that is not,
        `DepthRegistration` brings there.
    occluders : numpy.ndarray, shape (H, W) or (H, W, 1), bool or any integer type, optional
        Any non-zero is something in front that may hide cables: a robot rendered from its joints, or a detected hand.
        Where it is given, all the rest of the frame is in plain sight: a cable is not assumed hidden there.
    camera : PinholeCamera, optional
        Also its matrix K, shape (3, 3), or (fx, fy, cx, cy), or the path of a calibration, of which one is made.
        Without it, depth cannot become metres and there are no curves in space.
    index : int
        Position in the stream; a frame that could not be read leaves a hole.
    stamp : float, optional
        Time in seconds, up to 1e11.
    name : str
        Origin of the frame, for messages and file names.
    depth_unit_m : float
        Metres per count of an integer depth image (0.001: millimetres), 1e-9 to 1e3.
    mask_is : {"auto", "binary", "probability", "labels"}
        What the values of the mask are. "binary" and "labels": any non-zero is cable. "probability": as networks give
        it, of 8 or 16 bits, or in 0..1; it is held as uint8. "auto": floating point is a probability, and so is uint8
        of many grey values, nearly all of which are sure; all else is binary.

    Raises
    ------
    InputError
        If neither image nor mask is given, or shapes or types are wrong or disagree, or the camera is for images of
        another size, a stamp is no finite number of seconds, or the unit is out of range.
    """

    image: AnyArray | None = None
    mask: AnyArray | None = None
    depth: AnyArray | None = None
    occluders: AnyArray | None = None
    camera: PinholeCamera | None = None
    index: int = 0
    stamp: float | None = None
    name: str = ""
    depth_unit_m: float = MILLIMETRE_M
    mask_is: str = "auto"

    def __post_init__(self) -> None:
        if self.image is None and self.mask is None:
            raise InputError(f"a frame needs an image or a mask, got neither, or None for it ({NONE_IS})")
        check_mask_kind(self.mask_is)
        if self.image is not None:
            object.__setattr__(self, "image", _read_only(check_image(self.image)))
        if self.mask is not None:
            mask = check_mask(self.mask)
            if mask.dtype.kind == "f" and self.mask_is == "auto":
                object.__setattr__(self, "mask_is", "probability")
            known = as_probability(mask) if self.mask_is == "probability" else mask
            object.__setattr__(self, "mask", _read_only(known if known.dtype.kind != "f" else known != 0.0))
        if self.depth is not None:
            object.__setattr__(self, "depth", _read_only(check_depth(self.depth)))
        if self.occluders is not None:
            object.__setattr__(self, "occluders", _read_only(check_mask(self.occluders, "occluders")))
        for name in ("image", "mask", "depth", "occluders"):
            array = getattr(self, name)
            if array is not None and array.shape[:2] != self.size:
                remedy = _REGISTER if name == "depth" else ""
                raise InputError(
                    f"{name} must have the frame's size {self.size} (rows, columns), got {array.shape[:2]}{remedy}"
                )
        if self.camera is not None:
            camera = as_camera(self.camera)
            camera.check_size(self.size)
            object.__setattr__(self, "camera", camera)
        set_fields(
            self,
            index=check_integer("index", self.index, 0, MAX_WHOLE),
            stamp=check_stamp(self.stamp),
            name=check_text("name", self.name),
            depth_unit_m=check_number("depth_unit_m", self.depth_unit_m, *DEPTH_UNITS_M),
        )

    def __repr__(self) -> str:
        has = [name for name in ("image", "mask", "depth", "occluders", "camera") if getattr(self, name) is not None]
        height, width = self.size
        return f"Frame({self.index}: {width}x{height}, {', '.join(has)})"

    @property
    def size(self) -> tuple[int, int]:
        """``(H, W)``, rows and columns."""
        array = self.image if self.image is not None else self.mask
        assert array is not None  # the constructor saw to it
        return int(array.shape[0]), int(array.shape[1])


def as_frame(given: Frame | npt.ArrayLike, index: int = 0, *, grey_as_image: bool = False) -> Frame:
    """Return a frame as it is, and an array as one: a mask (H, W), or a colour image (H, W, 3).

    Axes of length one before or behind those of a mask are dropped. A picture of Pillow is taken by its mode. With
    `grey_as_image` an array (H, W) is a grey image, unless it is bool.

    Raises
    ------
    InputError
        If it is something else.
    """
    if isinstance(given, Frame):
        return given
    array = given if type(given) is np.ndarray else as_pixels("the frame", given, "any")
    if looks_like_image(array):
        return Frame(image=array, index=index)
    if grey_as_image and array.dtype != np.bool_:
        return Frame(image=_from_grey(array), index=index)
    return Frame(mask=array, index=index)


def _from_grey(array: AnyArray) -> AnyArray:
    plane = plane_of(array)
    if plane.ndim != 2 or plane.dtype != np.uint8:
        raise InputError(
            f"with a colour or a segmenter, an array (H, W) is a grey image and must be uint8, got {array.shape} of "
            f"{array.dtype}; if it is a mask, give Frame(mask=array) or array != 0"
        )
    return np.repeat(plane[:, :, None], 3, axis=2)


def _read_only(array: AnyArray) -> AnyArray:
    view = array.view()
    view.flags.writeable = False
    return view
