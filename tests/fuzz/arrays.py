"""Arrays of every type and layout, the right and the wrong ones: masks, images, depth."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

import dloftbs
from dloftbs import Config, DloftbsError, Frame, InputError, PinholeCamera, Pipeline
from fuzz import masks
from fuzz.checks import PAPER, check_result, in_time, own

Rng = np.random.Generator

MASK_TYPES = ("?", "i1", "u1", "<i2", ">i2", "<u2", ">u2", "<i4", ">i4", "u4", "<i8", ">i8", "<u8", ">u8")
DEPTH_TYPES = ("<f2", ">f2", "<f4", ">f4", "<f8", ">f8", "u1", "<u2", ">u2", "i4", ">i8", "u8")
LAYOUTS = ("plain", "fortran", "mirrored", "every other", "transposed", "read-only", "subclass", "column", "offset")


class Subclass(np.ndarray):
    """An array of a type of its own."""


def laid_out(array: np.ndarray, layout: str) -> np.ndarray:
    """Return an array of the same values in another layout."""
    if layout == "fortran":
        return np.asfortranarray(array)
    if layout == "mirrored":
        return np.ascontiguousarray(array[::-1, ::-1])[::-1, ::-1]
    if layout == "every other":
        return np.repeat(np.repeat(array, 2, axis=0), 3, axis=1)[::2, ::3]
    if layout == "transposed":
        return np.ascontiguousarray(array.T).T
    if layout == "read-only":
        array = array.copy()
        array.flags.writeable = False
        return array
    if layout == "subclass":
        return array.copy().view(Subclass)
    if layout == "column":
        return array[:, :, None]
    if layout == "offset":  # rows that begin anywhere in a larger buffer
        buffer = np.zeros(array.nbytes + 1, np.uint8)
        moved = buffer[1:].view(array.dtype).reshape(array.shape)
        moved[...] = array
        return moved
    return array.copy()


@dataclass(frozen=True)
class Laid:
    """A mask in a type and a layout."""

    mask: np.ndarray
    dtype: str
    layout: str


def laid_mask(rng: Rng) -> Laid:
    return Laid(masks.any_mask(rng), str(rng.choice(MASK_TYPES)), str(rng.choice(LAYOUTS)))


def check_laid_mask(case: Laid, _: Path) -> None:
    """Check that type and layout make no difference, and that the array is left as it was."""
    dtype = np.dtype(case.dtype)
    high = 1 if dtype.kind == "b" else np.iinfo(dtype).max
    array = laid_out(np.where(case.mask > 0, high, 0).astype(dtype), case.layout)
    before = array.tobytes()
    found = dloftbs.detect(array)
    assert array.tobytes() == before, "the mask was changed"
    expected = dloftbs.detect(case.mask)
    assert [d.to_dict() for d in found] == [d.to_dict() for d in expected]


WRONG: dict[str, Any] = {
    "nothing": None,
    "a number": 1,
    "0-d": np.array(1, np.uint8),
    "1-d": np.ones(5, np.uint8),
    "3-d": np.ones((4, 5, 2), np.uint8),
    "4-d": np.ones((1, 4, 5, 1), np.uint8),
    "floats": np.ones((20, 20)),
    "complex": np.ones((20, 20), complex),
    "text": np.full((4, 4), "a"),
    "bytes": b"abc",
    "a string": "mask.png",
    "objects": np.full((4, 4), None),
    "big integers": np.full((4, 4), 10**40),
    "ragged": [[1, 0], [1]],
    "ragged with None": [[1, 0], None],
    "timedelta": np.ones((20, 20), "m8[s]"),
    "datetime": np.zeros((20, 20), "M8[s]"),
    "structured": np.zeros((4, 4), [("a", "u1")]),
    "a dictionary": {"mask": 1},
    "a set": {1, 2},
    "empty": np.zeros((0, 0), np.uint8),
    "no rows": np.zeros((0, 10), np.uint8),
    "no columns": np.zeros((10, 0), np.uint8),
    "empty with channels": np.zeros((0, 0, 3), np.uint8),
    "a mapped class": np.zeros((20, 20), np.uint8).view(Subclass),
    "lists": [[0, 1, 0]] * 30,
    "booleans": [[True, False]] * 30,
    "itself": Frame,
}


def wrong_array(rng: Rng) -> Any:
    """Anything of any type and shape, as values that an array function takes."""
    shape = tuple(int(n) for n in rng.choice([0, 1, 2, 3, 4, 30], int(rng.integers(0, 5))))
    kind = str(rng.choice(["?", "u1", ">i4", "f2", "f8", "c16", "m8[ms]", "M8[D]", "U3", "S2", "O", "V4"]))
    return np.zeros(shape, kind) if rng.random() < 0.5 else np.ones(shape, "u1").astype(kind.replace("V4", "u1"))


def check_wrong_array(case: Any, _: Path) -> None:
    """Check that an array that is none of those of a frame is refused where it enters."""
    mask = np.zeros((20, 20), np.uint8)
    mask[8:12, 2:18] = 1
    own(lambda: dloftbs.detect(case))
    own(lambda: dloftbs.detect(instances=case))
    own(lambda: dloftbs.detect(mask, depth=case, camera=PinholeCamera(50.0, 50.0, 10.0, 10.0)))
    for name in ("image", "mask", "depth", "occluders", "instances"):
        given: dict[str, Any] = {"mask": mask, name: case}
        frame = own(lambda given=given: Frame(**given))
        if isinstance(frame, Frame):
            own(lambda frame=frame: check_result(Pipeline().process(frame)))
    own(lambda: list(dloftbs.sources.open(case)) if isinstance(case, np.ndarray) else None)
    own(lambda: check_result(Pipeline(segmenter=lambda _: case).process(Frame(image=np.zeros((20, 20, 3), np.uint8)))))


@dataclass(frozen=True)
class WithDepth:
    """A mask with a depth image and a camera."""

    mask: np.ndarray
    depth: np.ndarray
    camera: PinholeCamera
    changes: dict[str, Any]
    unit: float


TINY, HUGE = 1e-160, 1e300


def with_depth(rng: Rng) -> WithDepth:
    mask = masks.tangle(rng) if rng.random() < 0.7 else masks.any_mask(rng)
    rows, columns = np.indices(mask.shape)
    plane = rng.uniform(0.1, 3.0) + rng.normal(0, 0.004) * rows + rng.normal(0, 0.004) * columns
    depth = np.abs(plane + rng.normal(0, rng.choice([0.0, 0.003, 0.5]), mask.shape))
    for _ in range(int(rng.integers(0, 5))):
        values = [np.nan, np.inf, -np.inf, 0.0, -1.0, 5e-324, 1e-310, TINY, 1e-30, 1e-5, 19.9, 65.0, 1e30, HUGE]
        y, x = (int(rng.integers(0, n)) for n in mask.shape)
        height, width = int(rng.integers(1, 200)), int(rng.integers(1, 200))
        where = np.zeros(mask.shape, np.bool_)
        where[y : y + height, x : x + width] = True
        if rng.random() < 0.5:
            where &= rng.random(mask.shape) < 0.3
        depth[where] = rng.choice(values)
    dtype = np.dtype(str(rng.choice(DEPTH_TYPES)))
    with np.errstate(all="ignore"):
        if dtype.kind in "iu":
            depth = np.nan_to_num(depth * 1000, nan=0.0).clip(0, min(np.iinfo(dtype).max, 2**53))
        depth = laid_out(depth.astype(dtype), str(rng.choice(LAYOUTS)))
    focal = float(rng.choice([0.01, 50.0, 500.0, 1e6]))
    camera = PinholeCamera(focal, focal * rng.uniform(0.5, 2), mask.shape[1] / 2, mask.shape[0] / 2, _lens(rng))
    changes: dict[str, Any] = {}
    if rng.random() < 0.3:
        changes["lifting.max_depth_m"] = float(rng.choice([1e-3, 1.0, 1e300, np.inf]))
    unit = float(rng.choice([1e-300, 1e-12, 1e-9, 1.0, 1e3, 1e30])) if rng.random() < 0.3 else 0.001
    return WithDepth(mask, depth, camera, changes, unit)


def _lens(rng: Rng) -> tuple[float, ...]:
    kind = int(rng.integers(4))
    if kind < 2:
        return ()
    return tuple(float(v) for v in rng.normal(0, (0.1, 3.0)[kind - 2], int(rng.choice([4, 5, 8, 12]))))


def check_with_depth(case: WithDepth, _: Path) -> None:
    """Check that whatever depth says, curves in space are finite or have a reason why there are none."""
    before = case.depth.tobytes()
    for start in (Config(), PAPER):
        config = own(lambda start=start: start.replace(case.changes))
        if isinstance(config, DloftbsError):
            continue
        frame = own(lambda: Frame(mask=case.mask, depth=case.depth, camera=case.camera, depth_unit_m=case.unit))
        if isinstance(frame, DloftbsError):
            assert isinstance(frame, InputError)
            continue
        result = own(lambda config=config, frame=frame: in_time(lambda: Pipeline(config).process(frame)))
        if isinstance(result, DloftbsError):
            continue
        check_result(result)
    assert case.depth.tobytes() == before, "depth was changed"


def _depth_of(value: float, dtype: str = "f8") -> WithDepth:
    mask = np.zeros((60, 120), np.uint8)
    mask[28:33, 10:110] = 1
    return WithDepth(mask, np.full(mask.shape, value, dtype), PinholeCamera(100.0, 100.0, 60.0, 30.0), {}, 0.001)


DEPTH_FOUND = {
    "depth of 1e-160": _depth_of(TINY),
    "depth of 1e-310": _depth_of(1e-310),
    "depth of 1e300": _depth_of(HUGE),
    "a unit of 1e-300": WithDepth(
        _depth_of(1.0).mask, np.full((60, 120), 700, np.uint16), PinholeCamera(100.0, 100.0, 60.0, 30.0), {}, 1e-300
    ),
    "depth of NaN": _depth_of(np.nan),
    "depth of half precision": _depth_of(0.7, "f2"),
}


def check_image_colours(rng_seed: int, _: Path) -> None:
    """Check a segmentation by colour of noise of any kind, and that pictures of what was found can be drawn."""
    rng = np.random.default_rng(rng_seed)
    mask = masks.any_mask(rng)
    image = np.zeros((*mask.shape, 3), np.uint8)
    image[mask > 0] = (0, 0, 255)
    noise = rng.integers(0, int(rng.choice([1, 40, 255])), image.shape)
    image = (image.astype(np.int64) + noise).clip(0, 255).astype(np.uint8)
    image = laid_out(image, str(rng.choice(("plain", "fortran", "mirrored", "read-only"))))
    pipeline, frame = Pipeline(hsv="170:10,80:255,60:255"), Frame(image=image)
    result = in_time(lambda: pipeline.process(frame))
    check_result(result)
    for picture in (dloftbs.viz.draw(frame, result), dloftbs.viz.draw_stages(pipeline.trace(frame))):
        assert picture.dtype == np.uint8
        assert picture.ndim == 3


def some_seed(rng: Rng) -> int:
    """Return a seed, as the case of what draws for itself."""
    return int(rng.integers(2**31))
