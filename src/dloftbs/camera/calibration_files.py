"""Cameras from files, as calibrators write them: ROS, OpenCV, Kalibr, Open3D, RealSense, and our own keys.

Keys are compared without case and underscores. A camera is recognised by its keys, whatever wrote it.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from dloftbs.camera.lens_models import LensModel
from dloftbs.errors import InputError, SourceError
from dloftbs.support.arrays import FloatArray
from dloftbs.support.documents import parse_json, parse_opencv_xml, parse_yaml, read_text

T = TypeVar("T")
Camera = TypeVar("Camera")
Keys = dict[str, Any]
Values = dict[str, Any]
"""Arguments of `PinholeCamera.from_matrix`, with `matrix`, or of `PinholeCamera.from_dict`."""

_MODELS: dict[str, LensModel] = {
    **dict.fromkeys(("polynomial", "plumbbob", "rationalpolynomial", "radtan", "brownconrady", "opencv"), "polynomial"),
    **dict.fromkeys(("fisheye", "equidistant", "kannalabrandt4", "equi"), "fisheye"),
}
"""Names of the models that there are, in letters and digits alone."""
_EXACT_WITHOUT_DISTORTION = ("none", "modifiedbrownconrady", "inversebrownconrady")
"""Names that are taken only while all coefficients are 0: without distortion, all models are the same."""

COEFFICIENT_KEYS = (
    "distortioncoefficients", "distortioncoeffs", "distcoeffs", "distcoeff", "distcoefs", "distortion", "dist",
    "coeffs", "d",
)  # fmt: skip
"""Keys of the coefficients of a lens."""
MODEL_KEYS = ("distortionmodel", "cameramodel", "lensmodel", "model")
"""Keys of the model of a lens."""
FISHEYE_KEYS = ("fisheyemodel", "fisheye")
"""Keys of a flag that the model of a lens is the fisheye's."""
_SIZE_KEYS = ("imagewidth", "width", "imageheight", "height", "imagesize")
_READ_APART = frozenset((*COEFFICIENT_KEYS, *MODEL_KEYS, *FISHEYE_KEYS, *_SIZE_KEYS))
"""Keys of the lens and of the size of the images, which all forms have in common."""
_OF_A_LENS = re.compile("^dist(?!ance)|coef|^k[1-6]$")
"""Keys that are of a lens, however it is described."""
_ANY_LENS = "pinhole"
"""Model that says nothing of the lens, as Kalibr's `camera_model`."""

_REGISTRATION_KEYS = (
    *("depthcamera", "colourcamera", "colorcamera", "rotation", "translationm"),
    *("cam0", "cam1"),
    "depthunitm",
)

_LONGEST = 1000
"""Characters of a message, which may quote what a file says."""
_FORMS = (
    "ROS's camera_info (camera_matrix or K), OpenCV's FileStorage (camera_matrix), Kalibr's cam0 (intrinsics), "
    "Open3D's (intrinsic_matrix), RealSense's (fx, fy, ppx, ppy) or plain fx, fy, cx, cy"
)


def read_camera(path: Path, make: Callable[[Values], T]) -> T:
    """Read a camera, as `PinholeCamera.from_file` says; `make` builds it from what the file holds.

    Raises
    ------
    SourceError
        If the file cannot be read, is of no form that is known, or describes a camera that is not supported.
    """
    return _read(path, lambda keys: make(_camera(keys)))


def camera_values(keys: Mapping[str, Any]) -> Values:
    """Return the arguments that make a camera of what a file holds.

    Raises
    ------
    InputError
        If they are of no form that is known, or describe a camera that is not supported.
    """
    return _camera(normal_keys(keys))


def read_registration(path: Path, make_camera: Callable[[Values], object], make: Callable[..., T]) -> T:
    """Read a registration, as `DepthRegistration.from_file` says, and build it of its parts.

    The parts are two cameras, the rotation and the translation, and `depth_unit_m` by its name where the file has it.

    Raises
    ------
    SourceError
        If the file cannot be read or says something else.
    """

    def registration(keys: Keys) -> T:
        cameras, rotation, translation_m = _registration(keys, make_camera)
        unknown = [key for key in keys if key not in _REGISTRATION_KEYS]
        if unknown:
            raise InputError(
                "a registration has depth_camera, colour_camera, rotation, translation_m or Kalibr's cam0, cam1, and "
                f"optionally depth_unit_m; unknown: {', '.join(unknown)}"
            )
        unit = keys.get("depthunitm")
        known = {} if unit is None else {"depth_unit_m": _number("depth_unit_m", unit)}
        return make(*cameras, rotation, translation_m, **known)

    return _read(path, registration)


def _read(path: Path, make: Callable[[Keys], T]) -> T:
    try:
        return make(normal_keys(content_of(path)))
    except InputError as error:
        said = str(error)
        raise SourceError(f"{path}: {said[:_LONGEST]}{' ...' if len(said) > _LONGEST else ''}") from error


def content_of(path: Path) -> Any:
    """Return what a YAML, JSON or XML file holds."""
    text = read_text(path)
    if text.lstrip().startswith("<"):
        return parse_opencv_xml(text)
    if text.lstrip().startswith("{"):
        with suppress(InputError):  # OpenCV's JSON has numbers as YAML does, and YAML takes most of JSON, but no tabs
            return parse_json(text)
    # `ros2 topic echo` ends a message with the mark that begins the next document.
    documents = parse_yaml(text)
    if len(documents) != 1 or not isinstance(documents[0], dict):
        found = f"{len(documents)} documents" if len(documents) != 1 else type(documents[0]).__name__
        raise InputError(f"must hold one mapping of keys to values, found {found}")
    return documents[0]


def normal_keys(value: Any) -> Any:
    """Return what a file holds with keys without case and underscores."""
    if isinstance(value, Mapping):
        return {_plain(str(key)): normal_keys(item) for key, item in value.items()}
    return value


def _plain(name: str) -> str:
    return re.sub(r"[^a-z0-9]", "", name.lower())


def _camera(keys: Keys) -> Values:
    cameras = _chain(keys)
    if len(cameras) > 1:
        raise InputError(f"holds {len(cameras)} cameras, {', '.join(cameras)}; keep the one that is meant")
    for form in (_only_of_chain, _from_matrix, _from_kalibr, _from_open3d, _from_realsense, _from_plain):
        camera = form(keys)
        if camera is not None:
            return camera
    raise InputError(f"is no camera: expected {_FORMS}; found {', '.join(keys) or 'nothing'}")


def _chain(keys: Keys) -> Keys:
    return {key: value for key, value in keys.items() if re.fullmatch(r"cam[0-9]+", key) and isinstance(value, dict)}


def _only_of_chain(keys: Keys) -> Values | None:
    cameras = _chain(keys)
    return _camera(next(iter(cameras.values()))) if cameras else None


def _from_matrix(keys: Keys) -> Values | None:
    """Read ROS's and OpenCV's forms: a camera matrix, row after row."""
    matrix = first_of(keys, "cameramatrix", "k")
    if matrix is None:
        return None
    _check_whole(keys)
    return {"matrix": matrix_of(matrix), **_lens(keys), "size": _image_size(keys)}


def _from_kalibr(keys: Keys) -> Values | None:
    if "intrinsics" not in keys:
        return None
    kind = keys.get("cameramodel", "pinhole")
    if kind != "pinhole":
        raise InputError(f"camera_model must be pinhole, got {kind!r}")
    fx, fy, cx, cy = numbers_of("intrinsics", keys["intrinsics"], 4)
    return {"matrix": _k(fx, fy, cx, cy), **_lens(keys), "size": _image_size(keys, "resolution")}


def _from_open3d(keys: Keys) -> Values | None:
    if "intrinsicmatrix" not in keys:
        return None
    matrix = matrix_of(keys["intrinsicmatrix"])
    # Nine numbers in a row are column after column; nested, they are rows.
    columns_first = isinstance(keys["intrinsicmatrix"], list) and len(keys["intrinsicmatrix"]) == 9
    return {"matrix": matrix.T if columns_first else matrix, **_lens(keys), "size": _image_size(keys)}


def _from_realsense(keys: Keys) -> Values | None:
    if not {"fx", "fy", "ppx", "ppy"} <= keys.keys():
        return None
    fx, fy, cx, cy = (_number(key, keys[key]) for key in ("fx", "fy", "ppx", "ppy"))
    lens = _lens(keys)
    if lens["model"] == "fisheye" and len(lens["distortion"]) == 5 and lens["distortion"][4] == 0.0:
        lens["distortion"] = lens["distortion"][:4]
    return {"matrix": _k(fx, fy, cx, cy), **lens, "size": _image_size(keys)}


def _from_plain(keys: Keys) -> Values | None:
    if not {"fx", "fy", "cx", "cy"} & keys.keys():
        return None
    plain = {key: value for key, value in keys.items() if key not in _READ_APART and value is not None}
    for key in {"fx", "fy", "cx", "cy"} & plain.keys():
        plain[key] = _number(key, plain[key])
    size = _image_size(keys)
    return {**plain, **_lens(keys), **({} if size is None else {"size": size})}


def _lens(keys: Keys) -> Values:
    """Return the distortion and the model that a camera's keys state, the same in all forms.

    Raises
    ------
    InputError
        If a key seems to be of a lens and is unknown, two keys contradict each other, or the model is not supported.
    """
    unread = [key for key in keys if _OF_A_LENS.search(key) and key not in _READ_APART and keys[key] is not None]
    if unread:
        raise InputError(
            f"has keys of a lens that are unknown: {', '.join(unread)}; give its coefficients as a list in OpenCV's "
            "order, distortion: [k1, k2, p1, p2, k3], and its model as model: polynomial or model: fisheye"
        )
    stated = {key: numbers_of(key, keys[key]) for key in COEFFICIENT_KEYS if keys.get(key) is not None}
    coefficients = next(iter(stated.values()), ())
    if any(other != coefficients for other in stated.values()):
        raise InputError(f"{' and '.join(stated)} state different coefficients of the lens; keep those that are meant")
    names = [keys[key] for key in MODEL_KEYS if keys.get(key) and _plain(str(keys[key])) != _ANY_LENS]
    names += ["fisheye" for key in FISHEYE_KEYS if keys.get(key)]
    models = {_model(name, coefficients) for name in names} or {"polynomial"}
    if len(models) > 1:
        raise InputError(f"states several models of the lens, {', '.join(map(str, names))}; keep the one that is meant")
    return {"distortion": coefficients, "model": models.pop()}


def _model(name: Any, coefficients: tuple[float, ...]) -> LensModel:
    """Return the model of a name; without distortion, some names that are not supported are taken, too."""
    plain = re.sub("^(rs2)?distortion", "", _plain(str(name)))
    if plain in _EXACT_WITHOUT_DISTORTION:
        if any(coefficients):
            raise InputError(f"the distortion model {name!r} is not supported with coefficients other than 0")
        return "polynomial"
    if plain not in _MODELS:
        raise InputError(f"unknown distortion model {name!r}; known are {', '.join(_MODELS)}")
    return _MODELS[plain]


def _check_whole(keys: Keys) -> None:
    """Refuse ROS's messages of binned or cut images, whose intrinsics hold for the whole sensor."""
    binning = [_number("binning", keys.get(key) or 0) for key in ("binningx", "binningy")]
    region = keys["roi"] if isinstance(keys.get("roi"), dict) else {}
    cut = [region.get(key) or 0 for key in ("xoffset", "yoffset", "width", "height")]
    whole = [0, 0, keys.get("width") or keys.get("imagewidth"), keys.get("height") or keys.get("imageheight")]
    if max(binning) > 1 or (any(cut) and cut != whole):
        raise InputError(
            f"binning and regions of interest are not supported, got binning {binning} and region {cut} "
            "(x, y, width, height); state the intrinsics of the images themselves"
        )


def _registration(keys: Keys, make: Callable[[Values], Camera]) -> tuple[tuple[Camera, Camera], FloatArray, FloatArray]:
    if {"cam0", "cam1"} <= keys.keys():
        return _from_kalibr_chain(keys, make)
    cameras: dict[str, Camera] = {}
    for name, value in (
        ("depth_camera", keys.get("depthcamera")),
        ("colour_camera", first_of(keys, "colourcamera", "colorcamera")),
    ):
        if not isinstance(value, dict):
            raise InputError(
                f"a registration needs {name}, a camera, among depth_camera, colour_camera, rotation, translation_m; "
                f"or Kalibr's cam0 and cam1; found {', '.join(keys) or 'nothing'}"
            )
        try:
            cameras[name] = make(_camera(value))
        except InputError as error:
            raise InputError(f"{name}: {error}") from error
    rotation = matrix_of(_required(keys, "rotation"), "rotation")
    translation_m = np.array(numbers_of("translation_m", _required(keys, "translation_m"), 3))
    return (cameras["depth_camera"], cameras["colour_camera"]), rotation, translation_m


def _from_kalibr_chain(
    keys: Keys, make: Callable[[Values], Camera]
) -> tuple[tuple[Camera, Camera], FloatArray, FloatArray]:
    if len(_chain(keys)) != 2:
        raise InputError(f"a registration has two cameras, cam0 for depth and cam1 for colour; found {', '.join(keys)}")
    pose = np.array(numbers_of("T_cn_cnm1", _required(keys["cam1"], "T_cn_cnm1"), 16)).reshape(4, 4)
    return (make(_camera(keys["cam0"])), make(_camera(keys["cam1"]))), pose[:3, :3], pose[:3, 3]


def _required(keys: Keys, name: str) -> Any:
    if _plain(name) not in keys:
        raise InputError(f"lacks {name}; found {', '.join(keys)}")
    return keys[_plain(name)]


def first_of(keys: Keys, *names: str) -> Any:
    """Return the value of the first of some keys that has one; None where none has."""
    return next((keys[name] for name in names if keys.get(name) is not None), None)


def _k(fx: float, fy: float, cx: float, cy: float) -> FloatArray:
    return np.array([[fx, 0.0, cx], [0.0, fy, cy], [0.0, 0.0, 1.0]])


def matrix_of(value: Any, name: str = "the camera matrix") -> FloatArray:
    """Return nine numbers as a matrix (3, 3)."""
    return np.array(numbers_of(name, value, 9)).reshape(3, 3)


def _number(name: str, value: Any) -> float:
    return numbers_of(name, [value], 1)[0]


def numbers_of(name: str, value: Any, count: int | None = None) -> tuple[float, ...]:
    """Return the numbers of a list, of nested lists, or of a mapping with `data`; none for None."""
    shape: tuple[Any, Any] | None = None
    if isinstance(value, dict):
        shape = (value["rows"], value["cols"]) if {"rows", "cols"} <= value.keys() else None
        if "data" not in value:
            raise InputError(f"{name} must be numbers in a list or under data, got the keys {', '.join(value)}")
        value = value["data"]
    try:
        numbers = tuple(float(number) for number in _flat([] if value is None else value))
    except (TypeError, ValueError, OverflowError) as error:
        raise InputError(f"{name} must be numbers: {error}") from error
    if shape is not None:
        rows, cols = (_number(side, size) for side, size in zip(("rows", "cols"), shape, strict=True))
        if rows < 0.0 or cols < 0.0 or rows * cols != len(numbers):
            raise InputError(f"{name} says that it is {shape[0]} x {shape[1]}, but holds {len(numbers)} numbers")
    if count not in (None, len(numbers)):
        raise InputError(f"{name} must be {count} numbers, got {len(numbers)}")
    return numbers


def _flat(value: Any) -> list[Any]:
    """Return what nested lists hold, in order; an array of them would take the room of the longest text for each."""
    if not isinstance(value, list):
        return [value]
    parts = [_flat(item) for item in value]
    if len({len(part) if isinstance(item, list) else None for item, part in zip(value, parts, strict=True)}) > 1:
        raise ValueError("the lists differ in length")
    return [item for part in parts for item in part]


def _image_size(keys: Keys, *pairs: str) -> tuple[int, int] | None:
    """Return ``(H, W)`` of the images, stated as a pair ``(W, H)`` or apart; None where it is not stated."""
    pair = first_of(keys, "imagesize", *pairs)
    if pair:
        return _size(*numbers_of("the size of the images (width, height)", pair, 2))
    return _size(first_of(keys, "imagewidth", "width"), first_of(keys, "imageheight", "height"))


def _size(width: Any, height: Any) -> tuple[int, int] | None:
    """Return ``(H, W)``, or None where they are not stated: as None, or 0 in messages of some drivers."""
    if not width and not height:
        return None
    rows, columns = _number("height", height), _number("width", width)
    if not (rows > 0.0 and columns > 0.0 and rows.is_integer() and columns.is_integer()):
        raise InputError(f"width and height must be positive integers, got {width!r} and {height!r}")
    return int(rows), int(columns)
