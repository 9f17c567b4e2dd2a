"""Names of the lens models."""

from __future__ import annotations

from typing import Literal, get_args

LensModel = Literal["polynomial", "fisheye"]
LENS_MODELS: tuple[str, ...] = get_args(LensModel)
