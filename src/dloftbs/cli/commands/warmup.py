"""``dloftbs warmup``: the compiled kernels, made ready before they are needed."""

from __future__ import annotations

import logging
from time import perf_counter

import click


@click.command(short_help="Compile the kernels, once for this machine.")
def warmup() -> None:
    """Compile the kernels if this machine has not done so yet, and load them.

    They stay on disk. Without this command, the first one that needs them compiles them.
    """
    compiled = _Flag()
    logger = logging.getLogger("dloftbs.kernels")
    logger.addHandler(compiled)
    since = perf_counter()
    try:
        _process_once()
    finally:
        logger.removeHandler(compiled)
    seconds = perf_counter() - since
    what = "compiled, and saved for the next time," if compiled.raised else "loaded, compiled before,"
    click.echo(f"kernels {what} in {seconds:.1f} s")


class _Flag(logging.Handler):
    """Notices that something was logged: the kernels announce that they are being compiled."""

    raised = False

    def emit(self, record: logging.LogRecord) -> None:
        self.raised = True


def _process_once() -> None:
    """Take a small picture through all stages."""
    import numpy as np

    from dloftbs.camera import PinholeCamera
    from dloftbs.config import Config, HsvRange, SegmentationConfig
    from dloftbs.frame import Frame
    from dloftbs.pipeline import Pipeline

    image = np.zeros((64, 64, 3), np.uint8)
    image[30:34, 8:56] = (0, 0, 255)
    red = HsvRange(hue=(170, 10), saturation=(100, 255), value=(100, 255))
    camera = PinholeCamera(50.0, 50.0, 31.5, 31.5, distortion=(0.01, 0.0, 0.0, 0.0))
    frame = Frame(image=image, depth=np.ones((64, 64)), camera=camera)
    Pipeline(Config(segmentation=SegmentationConfig(hsv=(red,)))).process(frame)
