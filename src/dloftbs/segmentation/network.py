"""Image to the probability of cable by a network of the user's own, from an ONNX file."""

from __future__ import annotations

import os
from typing import Any

import cv2
import numpy as np
import numpy.typing as npt

from dloftbs.config import NetworkConfig
from dloftbs.errors import ConfigError
from dloftbs.support.arrays import check_image

_CHANNELS = 3
"""Number of channels of an image.

Source: by definition.
"""
_PROVIDERS = ("CUDAExecutionProvider", "CPUExecutionProvider")  # those that start at once


class NetworkSegmenter:
    """A callable ``image -> probability`` that runs a network with ONNX Runtime.

    The input is ``(1, 3, H, W)`` or ``(1, H, W, 3)``, as the model states; the output a score for each pixel, in one
    channel or several, of any size. An image of another size is scaled, and the probabilities are scaled back. Scores
    are taken for probabilities where all, and the threshold, are in 0..1, and else for log-odds.

    Parameters
    ----------
    config : NetworkConfig

    Raises
    ------
    ConfigError
        If ONNX Runtime is missing, or the model cannot be read or takes no image.
    """

    def __init__(self, config: NetworkConfig) -> None:
        self._config = config
        self._session = _open(config.file)
        inputs = self._session.get_inputs()
        if len(inputs) != 1 or len(inputs[0].shape) != 4:
            shapes = [list(one.shape) for one in inputs]
            raise ConfigError(f"{config.file}: the network must take one image of four dimensions, it takes {shapes}")
        self._name = inputs[0].name
        kinds = {"tensor(float)": np.float32, "tensor(uint8)": np.uint8, "tensor(float16)": np.float16}
        if inputs[0].type not in kinds:
            raise ConfigError(f"{config.file}: the network must take {', '.join(kinds)}, it takes {inputs[0].type}")
        self._kind = kinds[inputs[0].type]
        shape = inputs[0].shape
        self._channels_last = shape[1] != _CHANNELS and shape[3] == _CHANNELS
        if not self._channels_last and isinstance(shape[1], int) and shape[1] != _CHANNELS:
            raise ConfigError(f"{config.file}: the network must take three channels, it takes {list(shape)}")
        sides = shape[1:3] if self._channels_last else shape[2:4]
        stated = tuple(side if isinstance(side, int) and side > 0 else None for side in sides)
        self._size = self._size_of(stated)

    def _size_of(self, stated: tuple[int | None, ...]) -> tuple[int, int] | None:
        """Return rows and columns that the network gets; None where it takes an image as it is."""
        rows, columns = stated
        given = self._config.size
        if given is not None:
            if any(side not in (None, wanted) for side, wanted in zip(stated, given, strict=True)):
                raise ConfigError(f"{self._config.file}: the network takes {rows} x {columns}, onnx.size says {given}")
            return given
        return (rows, columns) if rows is not None and columns is not None else None

    def __call__(self, image: npt.NDArray[np.uint8]) -> npt.NDArray[np.float32]:
        """Return the probability of cable, (H, W) in 0..1, in an image (H, W, 3) BGR; it is one half at the threshold.

        Raises
        ------
        InputError
            If it is no such image.
        ConfigError
            If the network fails on it, or returns no scores of pixels.
        """
        image = check_image(image)
        size = image.shape[0], image.shape[1]
        if 0 in size:
            return np.zeros(size, np.float32)
        rows, columns = self._size or size
        scaled = image if size == (rows, columns) else cv2.resize(image, (columns, rows), interpolation=cv2.INTER_AREA)
        scores = self._scores(self._padded(scaled))
        sure = self._probability(scores)
        share = sure.shape[0] / _up(rows, self._config.multiple), sure.shape[1] / _up(columns, self._config.multiple)
        own = sure[: max(1, round(rows * share[0])), : max(1, round(columns * share[1]))]
        full = own if own.shape == size else cv2.resize(own, size[::-1], interpolation=cv2.INTER_LINEAR)
        return np.asarray(full, np.float32)

    def _padded(self, image: npt.NDArray[np.uint8]) -> npt.NDArray[Any]:
        """Return the network's input: channels in its order, padded, scaled, in its layout."""
        config = self._config
        below, right = (_up(side, config.multiple) - side for side in image.shape[:2])
        if below or right:
            image = cv2.copyMakeBorder(image, 0, below, 0, right, cv2.BORDER_REPLICATE)
        ordered = image[..., ::-1] if config.order == "rgb" else image
        if self._kind is np.uint8:
            values: npt.NDArray[Any] = ordered
        else:
            mean, std = np.array(config.mean, np.float32), np.array(config.std, np.float32)
            values = ((ordered * np.float32(config.scale) - mean) / std).astype(self._kind)
        return np.ascontiguousarray((values if self._channels_last else values.transpose(2, 0, 1))[None])

    def _scores(self, values: npt.NDArray[Any]) -> npt.NDArray[np.float32]:
        """Return the network's first output, shape (channels, rows, columns)."""
        try:
            output = np.asarray(self._session.run(None, {self._name: values})[0])
        except Exception as error:  # ONNX Runtime's errors share no base but this
            raise ConfigError(f"{self._config.file}: the network failed on {values.shape}: {error}") from error
        found = output[0] if output.ndim in (3, 4) and output.shape[0] == 1 else output
        if found.ndim == 2:
            found = found[None]
        if found.ndim != 3 or 0 in found.shape:
            raise ConfigError(f"{self._config.file}: expected scores of pixels, the network returned {output.shape}")
        if self._channels_last and found.shape[2] < min(found.shape[:2]):
            found = found.transpose(2, 0, 1)
        return found.astype(np.float32)

    def _probability(self, scores: npt.NDArray[np.float32]) -> npt.NDArray[np.float32]:
        """Return the probability of each pixel: of a channel, or of the largest of all but the ground's against it."""
        channel, least = self._config.channel, np.float32(self._config.threshold)
        if channel is None and len(scores) > 1:
            return _share(scores[1:].max(axis=0), scores[0])
        if channel is not None and channel >= len(scores) > 1:
            raise ConfigError(f"{self._config.file}: onnx.channel is {channel}, the network has {len(scores)}")
        score = scores[0 if channel is None or len(scores) == 1 else channel]
        if 0.0 < least < 1.0 and _in_0_to_1(score):
            return _share(score * (1 - least), (1 - score) * least)
        return _share(score, least)


def _share(one: npt.NDArray[np.float32], other: npt.NDArray[np.float32] | np.float32) -> npt.NDArray[np.float32]:
    """Return the probability of one of two: its share, of probabilities, or by the difference of log-odds."""
    if _in_0_to_1(one) and _in_0_to_1(np.asarray(other)) and np.ndim(other):
        both = one + other
        return np.divide(one, both, out=np.zeros_like(one), where=both > 0)
    with np.errstate(over="ignore"):
        return np.asarray(1 / (1 + np.exp(other - one)), np.float32)


def _in_0_to_1(values: npt.NDArray[np.float32]) -> bool:
    return bool(values.min() >= 0.0 and values.max() <= 1.0)


def _open(file: str) -> Any:
    """Open a model.

    Raises
    ------
    ConfigError
        If ONNX Runtime is missing or the file is no model.
    """
    try:
        import onnxruntime
    except ImportError as error:
        raise ConfigError(
            "segmentation.onnx needs ONNX Runtime, which is not installed: pip install 'dloftbs[onnx]'"
        ) from error
    if not os.path.isfile(file):
        raise ConfigError(f"segmentation.onnx.file: there is no file {file!r}")
    options = onnxruntime.SessionOptions()
    providers = [one for one in _PROVIDERS if one in onnxruntime.get_available_providers()]
    options.log_severity_level = 3  # errors, which are raised as well
    try:
        return onnxruntime.InferenceSession(file, options, providers=providers)
    except Exception as error:  # as above
        raise ConfigError(f"{file}: cannot read the network: {error}") from error


def _up(side: int, multiple: int) -> int:
    """Return the next multiple."""
    return -(-side // multiple) * multiple
