"""All compiled kernels, made ready before the first frame needs them."""

from __future__ import annotations

import importlib
from pathlib import Path


def load_kernels() -> int:
    """Compile the kernels that this machine has not compiled yet, and load those of all rooms.

    A small picture goes through all stages.

    Returns
    -------
    int
        Number of kernels that had to be compiled.
    """
    import numpy as np

    from dloftbs.camera import PinholeCamera
    from dloftbs.config import Config, HsvRange, SegmentationConfig
    from dloftbs.data.frame import Frame
    from dloftbs.kernels.preparation import prepare
    from dloftbs.pipeline import Pipeline

    for name in _kernel_modules():
        importlib.import_module(name)
    compiled = prepare()
    image = np.zeros((64, 64, 3), np.uint8)
    image[30:34, 8:56] = (0, 0, 255)
    red = HsvRange(hue=(170, 10), saturation=(100, 255), value=(100, 255))
    camera = PinholeCamera(50.0, 50.0, 31.5, 31.5, distortion=(0.01, 0.0, 0.0, 0.0))
    frame = Frame(image=image, depth=np.ones((64, 64)), camera=camera)
    Pipeline(Config(segmentation=SegmentationConfig(hsv=(red,)))).process(frame)
    return compiled


def _kernel_modules() -> list[str]:
    """List the modules with kernels: those in a folder of that name, wherever it is."""
    package = Path(__file__).parents[1]
    files = sorted(package.glob("**/kernels/**/*.py"))
    return [".".join((package.name, *file.relative_to(package).with_suffix("").parts)) for file in files]
