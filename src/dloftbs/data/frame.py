"""Input of the pipeline: one moment of a stream."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from dloftbs.camera import PinholeCamera, as_camera
from dloftbs.data.instance_labels import Size, are_masks_of_objects, as_labels
from dloftbs.errors import InputError
from dloftbs.support.array_likes import NONE_IS, as_pixels
from dloftbs.support.arrays import (
    AnyArray,
    FloatArray,
    as_float_array,
    check_depth,
    check_image,
    check_mask,
    looks_like_image,
    plane_of,
)
from dloftbs.support.mask_values import as_probability, kind_of, without_border
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
    shown,
)

_REGISTER = (
    "; depth of a camera of its own must be registered to the image first: DepthRegistration.register, "
    "or registration= of sources.open, or --registration"
)


_INSTANCES = "give detect(instances=x), and in a stream Frame(instances=x)"
"""Way of a mask per object into the package, for messages."""


_WAYS = {"probability": as_probability, "labels": without_border}
"""Changes to the values of a mask before it is held, by what they are."""


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
        It says nothing of the rest of the frame, where something else may.
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
        What the values of the mask are. "binary": any non-zero is cable. "labels": the same, and they are the instances
        where none are given; 255 beside numbers up to 32 is their border, and ground. "probability": as networks give
        it, of 8 or 16 bits, or in 0..1; it is held as uint8. "auto": floating point is a probability, and so are 8 or
        16 bits of many grey values, nearly all of which are sure; at least two numbers, all up to 32, are labels; all
        else is binary. In a stream, few values are what the first mask was that is no binary one.
    instances : numpy.ndarray, shape (H, W), integer, optional
        Label image of single objects, held as uint16: 0 is ground, any other number an object. Also a stack (N, H, W),
        a list of masks or of SAM's dictionaries, of which object k becomes k + 1 (see `instance_labels.as_labels`).
        Without a mask, `mask` is where they are not 0; beside a mask they only say which pixels belong together.
    grippers : array_like, shape (n, 4), optional
        Places at which something holds cables: x, y, z in the camera's frame and a radius, metres. The end of a track
        this near is `held`.

    Raises
    ------
    InputError
        If neither image, mask nor instances are given, or shapes or types are wrong or disagree, or the camera is for
        images of another size, a stamp is no finite number of seconds, or the unit is out of range.
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
    instances: AnyArray | None = None
    grippers: FloatArray | None = None

    def __post_init__(self) -> None:
        if self.image is None and self.mask is None and self.instances is None:
            raise InputError(
                f"a frame needs an image, a mask or instances, got none of them, or None for it ({NONE_IS})"
            )
        check_mask_kind(self.mask_is)
        if self.image is not None:
            object.__setattr__(self, "image", _read_only(check_image(self.image)))
        if self.mask is not None:
            mask = check_mask(self.mask, may_be_soft=True)
            if mask.dtype.kind == "f" and self.mask_is == "auto":
                object.__setattr__(self, "mask_is", "probability")
            known = _WAYS.get(self.mask_is, np.asarray)(mask)
            object.__setattr__(self, "mask", _read_only(known if known.dtype.kind != "f" else known != 0.0))
            if self.mask_is == "labels" and self.instances is None:
                object.__setattr__(self, "instances", known)
        if self.depth is not None:
            object.__setattr__(self, "depth", _read_only(check_depth(self.depth)))
        if self.occluders is not None:
            object.__setattr__(self, "occluders", _read_only(check_mask(self.occluders, "occluders")))
        if self.instances is not None:
            labels = as_labels(self.instances, self._known_size())
            object.__setattr__(self, "instances", _read_only(labels))
            if self.mask is None:
                object.__setattr__(self, "mask", _read_only(labels != 0))
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
            grippers=None if self.grippers is None else _check_grippers(self.grippers),
        )

    def __repr__(self) -> str:
        names = ("image", "mask", "depth", "occluders", "instances", "camera")
        has = [name for name in names if getattr(self, name) is not None]
        height, width = self.size
        return f"Frame({self.index}: {width}x{height}, {', '.join(has)})"

    @property
    def size(self) -> tuple[int, int]:
        """``(H, W)``, rows and columns."""
        size = self._known_size()
        assert size is not None  # the constructor saw to it
        return size

    @property
    def is_cable(self) -> npt.NDArray[np.bool_] | None:
        """Pixels that are cable by what `mask_is` says of the mask's values, shape (H, W); None without a mask.

        Of a probability, these are from one half on; else they are any non-zero, but the border of labels.
        """
        from dloftbs.kernels.shared.soft_masks import HALF  # late: the types of the package load without the compiler

        mask = self.mask
        if mask is None:
            return None
        kind = kind_of(mask) if self.mask_is == "auto" else self.mask_is
        if kind == "probability":
            return as_probability(mask) >= HALF
        return (without_border(mask) if kind == "labels" else mask) != 0

    def _known_size(self) -> Size | None:
        """Return the size of the image or the mask, None before there is either."""
        array = self.image if self.image is not None else self.mask
        return None if array is None else (int(array.shape[0]), int(array.shape[1]))


def as_frame(
    given: Frame | npt.ArrayLike, index: int = 0, *, grey_as_image: bool = False, mask_is: str = "auto"
) -> Frame:
    """Return a frame as it is, and an array as one: a mask (H, W), or a colour image (H, W, 3).

    Axes of length one before or behind those of a mask are dropped. A picture of Pillow is taken by its mode. With
    `grey_as_image` an array (H, W) is a grey image, unless it is bool; `mask_is` says what the values of masks are.

    Raises
    ------
    InputError
        If it is something else.
    """
    if isinstance(given, Frame):
        return given
    if are_masks_of_objects(given):
        raise InputError(f"{shown(given)} is a mask per object: {_INSTANCES}")
    if isinstance(given, Mapping) and are_masks_of_objects([given]):
        raise InputError(
            f"{shown(given)} is the mask of one object: put those of a frame into a list, and {_INSTANCES}"
        )
    array = given if type(given) is np.ndarray else as_pixels("the frame", given, "any")
    if looks_like_image(array):
        return Frame(image=array, index=index, mask_is=mask_is)
    if grey_as_image and array.dtype != np.bool_:
        return Frame(image=_from_grey(array), index=index, mask_is=mask_is)
    return Frame(mask=array, index=index, mask_is=mask_is)


def _from_grey(array: AnyArray) -> AnyArray:
    plane = plane_of(array)
    if plane.ndim != 2 or plane.dtype != np.uint8:
        raise InputError(
            f"with a colour or a segmenter, an array (H, W) is a grey image and must be uint8, got {array.shape} of "
            f"{array.dtype}; if it is a mask, give Frame(mask=array) or array != 0"
        )
    return np.repeat(plane[:, :, None], 3, axis=2)


def _check_grippers(grippers: npt.ArrayLike) -> FloatArray:
    rows = as_float_array("grippers", grippers)
    if rows.ndim != 2 or rows.shape[1] != 4 or not (rows[:, 3] >= 0.0).all():
        raise InputError(
            f"grippers must have shape (n, 4), x, y, z and a radius that is not negative, got {shown(rows.tolist())}"
        )
    return _read_only(rows)


def _read_only(array: AnyArray) -> AnyArray:
    view = array.view()
    view.flags.writeable = False
    return view
