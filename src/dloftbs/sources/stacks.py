"""Stacks of frames: numpy arrays, .npy and .npz files."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
import numpy.typing as npt

from dloftbs.camera import DepthRegistration, PinholeCamera
from dloftbs.data.frame import Frame
from dloftbs.errors import InputError, SourceError, source_errors
from dloftbs.sources.npz_members import NpzMember, read_whole
from dloftbs.sources.pixels import GREY_AS_IMAGE, Kind, image_or_mask, load_npy
from dloftbs.sources.source import ReadSource, logger
from dloftbs.support.arrays import AnyArray, check_mask, depth_remedy, holds_depth, plane_of
from dloftbs.support.npy import File, InMemory, is_npy
from dloftbs.support.values import MILLIMETRE_M, ROUNDING_S, is_same_time

Stack = AnyArray | NpzMember
"""Array that is indexed frame by frame along its first axis."""

STACK_EXTENSIONS = (".npy", ".npz")
NPZ_KEYS = {
    "images": "(N, H, W, 3) uint8",
    "masks": "(N, H, W)",
    "depth": "(N, H, W)",
    "occluders": "(N, H, W)",
    "instances": "(N, H, W) numbers of objects",
    "stamps": "(N,) seconds",
    "camera": "(4,) fx, fy, cx, cy",
    "distortion": "(n,) of the camera",
    "distortion_model": "its name",
}


_LENS_KEYS = {"distortion": "distortion", "model": "distortion_model"}


class ArraySource(ReadSource):
    """Stacks of images, masks, depth, occluders and instances, indexed together; frames are views of those in memory.

    Parameters
    ----------
    name : str
    images : Stack, shape (N, H, W, 3), uint8, optional
        BGR.
    masks : Stack, shape (N, H, W), (N, 1, H, W) or (N, H, W, 1), bool or integer, optional
    depth : Stack, shape (N, H, W), floating point (metres) or integer, optional
    occluders : Stack, shape (N, H, W), bool or integer, optional
    instances : Stack, shape (N, H, W), integer, optional
        Label images (see `Frame`).
    stamps : array_like, shape (N,), optional
        Seconds. Different frames that share a stamp, as where it was rounded, are spread evenly from it to the next
        one, with a warning. If all have the same, there is none.
    kind : {"auto", "image", "mask"}
        "auto" takes images for images and masks for masks. Where both are given, "image" and "mask" leave the other
        out; where one is given, it is turned into the kind asked for.
    mask_is : {"auto", "binary", "probability", "labels"}
        What the values of masks are, as `Frame` has it.
    camera : PinholeCamera, optional
        Goes with every frame.
    fps : float, optional
        Gives the stamps ``index / fps``, in place of `stamps`.
    registration : DepthRegistration, optional
        Brings the depth, which may then have a size of its own, into the images.
    depth_unit_m : float
        Metres per count of integer depth.

    Raises
    ------
    InputError
        If neither images, masks nor instances are given, or shapes or types are wrong or disagree.
    """

    def __init__(
        self,
        name: str,
        *,
        images: Stack | None = None,
        masks: Stack | None = None,
        depth: Stack | None = None,
        occluders: Stack | None = None,
        instances: Stack | None = None,
        stamps: npt.ArrayLike | None = None,
        kind: Kind = "auto",
        mask_is: str = "auto",
        camera: PinholeCamera | None = None,
        fps: float | None = None,
        registration: DepthRegistration | None = None,
        depth_unit_m: float = MILLIMETRE_M,
    ) -> None:
        stacks = {"images": images, "masks": masks, "depth": depth, "occluders": occluders, "instances": instances}
        self._stacks = {key: stack for key, stack in stacks.items() if stack is not None}
        self.name = name
        self.fps = fps
        self.length = check_stacks(self._stacks, registered=registration is None)
        self._stamps = None if stamps is None else _check_stamps(stamps, self.length)
        self._spread = None if self._stamps is None else _spread(self._stamps)
        self._has_warned = False
        if images is not None and masks is not None and kind != "auto":
            del self._stacks["masks" if kind == "image" else "images"]
        if (
            kind == "image"
            and "images" not in self._stacks
            and "masks" in self._stacks
            and self._stacks["masks"].dtype != np.uint8
        ):
            raise InputError(
                f"masks must be uint8 to be taken for images, got {self._stacks['masks'].dtype}; to use them as masks, "
                "leave out the colour, or give kind='mask' (--kind mask)"
            )
        self.has_depth = "depth" in self._stacks
        self._kind = kind
        self._mask_is = mask_is
        self._camera = camera
        self._registration = registration
        self._depth_unit_m = depth_unit_m

    def close(self) -> None:
        """Close the files, and let go of the arrays."""
        super().close()
        for stack in self._stacks.values():
            if isinstance(stack, NpzMember):
                stack.close()
        self._stacks = {}  # lets go of memory-mapped files

    def _frames(self) -> Iterator[Frame]:
        assert self.length is not None  # the constructor counted
        stamp: float | None = None
        last: list[AnyArray] = []
        for index in range(self.length):
            image, mask = self._image_and_mask(index)
            occluders, instances = (
                self._stacks[key][index] if key in self._stacks else None for key in ("occluders", "instances")
            )
            pixels = [array for array in (image, mask, instances) if array is not None]
            stamp = self._stamp(index, stamp, last, pixels)
            last = pixels
            depth = self._depth(index, pixels[0])
            yield Frame(
                image,
                mask,
                depth,
                occluders,
                self._camera,
                index,
                stamp,
                f"{self.name}#{index}",
                self._depth_unit_m,
                self._mask_is,
                instances=instances,
            )
            if self._closed:
                return

    def _image_and_mask(self, index: int) -> tuple[AnyArray | None, AnyArray | None]:
        given = {key: self._stacks[key][index] for key in ("images", "masks") if key in self._stacks}
        if len(given) != 1 or self._kind == "auto":
            return given.get("images"), given.get("masks")
        (pixels,) = given.values()
        return image_or_mask(pixels if "images" in given else plane_of(pixels), self._kind, self._mask_is, lossy=False)

    def _depth(self, index: int, pixels: AnyArray) -> AnyArray | None:
        depth = self._stacks["depth"][index] if self.has_depth else None
        if depth is None or self._registration is None:
            return depth
        return self._registration.register(depth, pixels.shape[:2])

    def _stamp(
        self, index: int, previous: float | None, last: Sequence[AnyArray], pixels: Sequence[AnyArray]
    ) -> float | None:
        """Return the stamp of a frame behind another one, whose stamp and pixels are known."""
        if self.fps is not None:
            return index / self.fps
        if self._stamps is None:
            return None
        if index and is_same_time(self._stamps[index], self._stamps[index - 1]):
            if all(map(np.array_equal, last, pixels)):
                return previous
            self._warn_of_shared(index)
        return None if self._spread is None else float(self._spread[index])

    def _warn_of_shared(self, index: int) -> None:
        if self._has_warned:
            return
        self._has_warned = True
        assert self._stamps is not None  # one is shared
        logger.warning(
            "%s: frame %d differs from the one before it and has the same stamp, %.17g s; %s: save stamps in float64 "
            "that are not rounded, or give the rate (fps, --fps)",
            self.name,
            index,
            self._stamps[index],
            "all stamps are the same, and none is used" if self._spread is None else "such frames are spread evenly",
        )


def from_array(
    array: AnyArray, name: str, kind: Kind, mask_is: str, camera: PinholeCamera | None, fps: float | None
) -> ArraySource:
    """Open an array of images (N, H, W, 3) or masks (N, H, W); one mask may be (H, W) or (H, W, 1).

    Raises
    ------
    InputError
        If the array is neither.
    """
    if kind == GREY_AS_IMAGE:  # no camera gives bool
        kind = "auto" if array.dtype == np.bool_ else "image"
    if array.ndim == 2 or (array.ndim == 3 and array.shape[2] == 1):
        array = array[None]
    if array.ndim == 3 and array.shape[2] in (3, 4) and kind != "mask":
        raise InputError(
            f"an array of images must have shape (N, H, W, 3), got {array.shape}; if it is one image, pass array[None]"
        )
    if array.ndim == 4 and _size_of_planes(array.shape) is None:
        return ArraySource(name, images=array, kind=kind, mask_is=mask_is, camera=camera, fps=fps)
    return ArraySource(name, masks=array, kind=kind, mask_is=mask_is, camera=camera, fps=fps)


def from_file(
    file: File,
    kind: Kind,
    mask_is: str,
    camera: PinholeCamera | None,
    fps: float | None,
    registration: DepthRegistration | None = None,
    depth_unit_m: float = MILLIMETRE_M,
) -> ArraySource:
    """Open a .npy file as `from_array`, or a .npz file with the arrays of `NPZ_KEYS`; an explicit camera comes first.

    On disk the suffix distinguishes them, in memory the content.

    Raises
    ------
    SourceError
        If the file is corrupt or does not hold what it should.
    """
    with source_errors(file, InputError):
        if _is_npy(file):
            return from_array(load_npy(file), file.name, kind, mask_is, camera, fps)
        return _from_npz(file, kind, mask_is, camera, fps, registration, depth_unit_m)


def _is_npy(file: File) -> bool:
    return is_npy(file.data) if isinstance(file, InMemory) else file.suffix.lower() == ".npy"


def _from_npz(
    file: File,
    kind: Kind,
    mask_is: str,
    camera: PinholeCamera | None,
    fps: float | None,
    registration: DepthRegistration | None,
    depth_unit_m: float,
) -> ArraySource:
    keys, small = read_whole(file, ("stamps", "camera", "distortion", "distortion_model"))
    if not {"images", "masks", "instances"}.intersection(keys):
        expected = "; ".join(f"{key} {shape}" for key, shape in NPZ_KEYS.items())
        found = ", ".join(keys) or "none"
        raise SourceError(
            f"{file}: needs the array 'images', 'masks' or 'instances'; found {found}; expected {expected}"
        )
    if camera is None and "camera" in small:
        camera = _camera(small)
    if kind == GREY_AS_IMAGE:  # the keys say what the arrays are
        kind = "auto"
    stacks = {
        key: NpzMember(file, key) for key in ("images", "masks", "depth", "occluders", "instances") if key in keys
    }
    stamps = small.get("stamps")
    return ArraySource(
        file.name,
        **stacks,
        stamps=stamps,
        kind=kind,
        mask_is=mask_is,
        camera=camera,
        fps=fps,
        registration=registration,
        depth_unit_m=depth_unit_m,
    )


def check_stacks(stacks: dict[str, Stack], *, registered: bool = True) -> int:
    """Return the number of frames of the stacks, of which "images", "masks" or "instances" are given.

    Depth that is not registered yet may have another size.

    Raises
    ------
    InputError
        If shapes or types are wrong or disagree, or there is no frame.
    """
    if not {"images", "masks", "instances"}.intersection(stacks):
        raise InputError("images, masks or instances must be given, got none of them")
    for key, stack in stacks.items():
        check_stack(key, stack)
    shapes = {key: _size(key, stack)[: 3 if registered or key != "depth" else 1] for key, stack in stacks.items()}
    counts = {shape[0] for shape in shapes.values()}
    if len(counts) > 1 or len({shape for shape in shapes.values() if len(shape) == 3}) > 1:
        remedy = "; depth of a camera of its own needs a registration" if "depth" in stacks else ""
        raise InputError(f"the arrays must agree in (N, H, W), got {shapes}{remedy}")
    return int(next(iter(shapes.values()))[0])


def check_stack(key: str, stack: Stack) -> None:
    """Check a stack by its name: "images", "masks", "depth", "occluders" or "instances".

    Raises
    ------
    InputError
        If its shape or type is wrong, or there is no frame.
    """
    dtype = stack.dtype
    if key == "images":
        expected = "(N, H, W, 3) of uint8"
        valid = stack.ndim == 4 and stack.shape[3] == 3 and dtype == np.uint8
    else:
        kinds = "biuf" if key == "masks" else "biu"
        expected = f"(N, H, W) of {_TYPES.get(key, 'bool')} or integers"
        known = holds_depth(dtype) if key == "depth" else dtype.kind in kinds
        valid = _size_of_planes(stack.shape) is not None and known
        if valid and key == "masks" and dtype.kind == "f" and 0 not in stack.shape:
            check_mask(stack[0], may_be_soft=True)
    if not valid or 0 in stack.shape:
        raise InputError(
            f"{key} must have shape {expected}, with at least one frame; got {stack.shape} of {dtype}"
            f"{_remedy(key, stack)}"
        )


_TYPES = {"depth": "floating point", "masks": "bool, a probability in 0..1,"}
"""Of stacks by their names, integers aside, where it is not bool alone."""


def _remedy(key: str, stack: Stack) -> str:
    """Return what makes a stack of an array that is none, to be added to a message; nothing where that is unclear."""
    if key != "images":
        if key == "depth":
            return "" if holds_depth(stack.dtype) else depth_remedy(stack.dtype)
        is_score = key != "masks" and stack.dtype.kind == "f"
        return f"; threshold them first: {key} > 0.5" if is_score else ""
    if stack.ndim == 4 and stack.shape[1] == 3:
        return "; channels come last: images.transpose(0, 2, 3, 1), and [..., ::-1] of that if they are RGB"
    if stack.ndim == 4 and stack.shape[3] == 4:
        return "; four channels: images[..., :3] if they are BGRA, images[..., 2::-1] if they are RGBA"
    if stack.ndim == 4 and stack.shape[3] == 3 and stack.dtype.kind == "f":
        return "; scale them first: (255 * images).astype(np.uint8) if they are in 0..1"
    return ""


def _size(key: str, stack: Stack) -> tuple[int, ...]:
    """Return ``(N, H, W)`` of a stack that was checked."""
    return stack.shape[:3] if key == "images" else _size_of_planes(stack.shape) or stack.shape


def _size_of_planes(shape: tuple[int, ...]) -> tuple[int, int, int] | None:
    """Return ``(N, H, W)`` of a stack of masks or depth, (N, H, W), (N, H, W, 1) or (N, 1, H, W); None of all else."""
    if len(shape) == 3:
        return shape[0], shape[1], shape[2]
    if len(shape) == 4 and shape[3] == 1:
        return shape[0], shape[1], shape[2]
    return (shape[0], shape[2], shape[3]) if len(shape) == 4 and shape[1] == 1 and shape[3] != 3 else None


def _check_stamps(stamps: npt.ArrayLike, length: int) -> npt.NDArray[np.float64]:
    array = np.asarray(stamps)
    if array.shape != (length,) or array.dtype.kind not in "fiu" or not np.isfinite(array).all():
        raise InputError(f"stamps must be {length} finite numbers, got {array.shape} of {array.dtype}")
    return array.astype(np.float64)


def _spread(stamps: npt.NDArray[np.float64]) -> npt.NDArray[np.float64] | None:
    """Return stamps (N,), of which those that are shared are spread evenly from there to the next; None if all are.

    Where no later one follows, the step is the median of the others.
    """
    starts = np.flatnonzero(np.abs(np.diff(stamps, prepend=-np.inf)) > ROUNDING_S)
    counts = np.diff(starts, append=len(stamps))
    steps_s = np.diff(stamps[starts], append=np.nan) / counts
    later = steps_s[steps_s > 0.0]
    if counts.max() > 1 and not later.size:
        return None
    steps_s = np.where(steps_s > 0.0, steps_s, np.median(later) if later.size else 0.0)
    run = np.repeat(np.arange(len(starts)), counts)
    return stamps[starts][run] + steps_s[run] * (np.arange(len(stamps)) - starts[run])


def _camera(small: dict[str, AnyArray]) -> PinholeCamera:
    values = small["camera"]
    if values.shape != (4,) or values.dtype.kind not in "fiu":
        raise InputError(f"camera must be four numbers fx, fy, cx, cy, got {values.shape} of {values.dtype}")
    intrinsics = dict(zip(("fx", "fy", "cx", "cy"), values.tolist(), strict=True))
    lens = {key: small[name].tolist() for key, name in _LENS_KEYS.items() if name in small}
    return PinholeCamera.from_dict({**intrinsics, **lens})
