"""The demo's part in space: a cable by its colour and noisy depth, its curves in metres, held against the true axis."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any

import cv2
import numpy as np

from dloftbs import viz
from dloftbs.cli.outputs import config_beside, open_outputs, write_config
from dloftbs.config import Config, HsvRange, SegmentationConfig
from dloftbs.data.frame import Frame
from dloftbs.data.frame_result import FrameResult
from dloftbs.pipeline import Pipeline
from dloftbs.support.arrays import AnyArray
from dloftbs.support.safe_files import write_whole
from dloftbs_lab.commands.demo_run import STYLE
from dloftbs_lab.commands.scoring import NOTHING, spread, spread_text
from dloftbs_lab.evaluation import length_error, match_curves
from dloftbs_lab.synthetic import TYPICAL_NOISE, RgbdSequence, depth_sigma, rgbd_artificial
from dloftbs_lab.truth import Truth

FIGURE, FOLDER = "space.png", "space"
IMAGE, DEPTH = f"{FOLDER}/image.png", f"{FOLDER}/depth.png"
CONFIG = f"{FOLDER}/curves.config.yaml"
CURVES = (f"{FOLDER}/curves.jsonl", f"{FOLDER}/curves.csv", f"{FOLDER}/curves.ply")
WHAT = {
    FIGURE: "a frame of a cable in space: picture, depth, and the curve in metres from above and from the side",
    f"{FOLDER}/": "that frame's picture and depth; the curves of all frames as JSON lines, CSV and meshes",
}
_SCENE = 1  # which lays the cable over itself
_SCENE_FRAMES = 280
_BLUE = HsvRange.parse("95:120,100:255,30:255")
_MM_PER_M = 1e3
_SIGMA_SAMPLES = 100


@dataclass
class SpaceRun:
    """Outcome of the demo's part in space.

    Parameters
    ----------
    sequence : RgbdSequence
    l3_mm, length_errors : list of float
        Of each frame: criterion 3 in space, and the share by which the length is off; NaN without a curve there.
    reasons : list of str
        Reason why there was none.
    """

    sequence: RgbdSequence
    l3_mm: list[float] = field(default_factory=list)
    length_errors: list[float] = field(default_factory=list)
    reasons: list[str] = field(default_factory=list)

    def score(self, result: FrameResult, truth: Truth) -> None:
        """Hold a frame's curves in space against the true axis."""
        found = [track.curve_3d for track in result.tracks if track.detection is not None]
        curves = [curve for curve in found if curve is not None]
        if not curves:
            self.l3_mm.append(math.nan)
            self.length_errors.append(math.nan)
            whys = [d.no_3d_reason for d in result.detections if d.no_3d_reason is not None]
            self.reasons.append("; ".join(whys) or result.reason or "")
            return
        (pair,) = match_curves(curves, truth.curves_3d).pairs
        self.l3_mm.append(_MM_PER_M * pair.l3)
        self.length_errors.append(length_error(curves[pair.found], truth.curves_3d[0]))

    def to_dict(self) -> dict[str, Any]:
        """Return the figures as plain values; those without a value are None."""
        camera = self.sequence.camera
        return {
            "sequence": self.sequence.name,
            "frames": len(self.l3_mm),
            "camera": [camera.fx, camera.fy, camera.cx, camera.cy],
            "depth": asdict(self.sequence.noise),
            "sigma_mm": self._sigma_mm(),
            "frames_without_a_curve": int(np.isnan(self.l3_mm).sum()),
            "reasons": sorted(set(self.reasons)),
            "l3_mm": spread(self.l3_mm),
            "length_error": spread(self.length_errors),
        }

    def _sigma_mm(self) -> float:
        """Return the deviation of the depth's noise where the cable is, in the middle of the sequence."""
        (axis,) = self.sequence.truth(len(self.sequence) // 2).curves_3d
        sigma_m = depth_sigma(axis.sample(_SIGMA_SAMPLES)[:, 2]).mean()
        return _MM_PER_M * self.sequence.noise.depth_noise * float(sigma_m)

    def rows(self) -> list[tuple[str, str]]:
        """Return the figures as lines of a table."""
        figures, noise = self.to_dict(), self.sequence.noise
        length = figures["length_error"]
        rows = [
            (
                "in space",
                f"{figures['frames']} frames; noise of {figures['sigma_mm']:.1f} mm, "
                f"{noise.hole_share:.0%} of the cable without depth, flying pixels",
            ),
            ("L3, curve to true axis", spread_text(figures["l3_mm"], "mm")),
            (
                "length in space",
                NOTHING
                if length["mean"] is None
                else f"off by {100 * length['mean']:.2f} % in the mean, {100 * length['worst']:.2f} % at worst",
            ),
        ]
        if figures["frames_without_a_curve"]:
            why = "; ".join(figures["reasons"])
            rows.append(("without a curve there", f"{figures['frames_without_a_curve']} frames: {why}"))
        return rows

    def command(self) -> str:
        """Return the command that does the frame of the figure alone."""
        camera = ",".join(map(repr, self.to_dict()["camera"]))
        return f"dloftbs detect {IMAGE} --depth {DEPTH} --camera {camera} --config {CONFIG} --out cable.ply"


def follow_in_space(frames: int, size: tuple[int, int], seed: int, folder: Path) -> SpaceRun:
    """Track a generated cable by its colour, with depth as a sensor gives it, write all files, and score it.

    Raises
    ------
    SinkError
        If a file cannot be written.
    """
    sequence = rgbd_artificial(frames / _SCENE_FRAMES, seed, size, TYPICAL_NOISE, with_image=True)[_SCENE]
    config = Config(segmentation=SegmentationConfig(hsv=(_BLUE,)))
    run, pipeline = SpaceRun(sequence), Pipeline(config)
    with open_outputs([str(folder / name) for name in CURVES]) as sink:
        for frame in _as_a_sensor_gives_it(sequence):
            result = pipeline.process(frame)
            sink.write(frame, result)
            run.score(result, sequence.truth(frame.index))
            if frame.index == len(sequence) // 2:
                _write_png(folder / IMAGE, frame.image)
                _write_png(folder / DEPTH, frame.depth)
                figure = viz.draw_3d(frame, result, style=STYLE)
                _write_png(folder / FIGURE, figure)
    write_config(config_beside([str(folder / CURVES[0])], config), config)
    return run


def _as_a_sensor_gives_it(sequence: RgbdSequence) -> Iterator[Frame]:
    """Yield the frames without the true mask, their depth in whole counts."""
    for frame in sequence:
        assert frame.depth is not None  # the sequence draws it
        counts = np.rint(frame.depth / frame.depth_unit_m).clip(0, np.iinfo(np.uint16).max).astype(np.uint16)
        yield replace(frame, mask=None, depth=counts)


def _write_png(path: Path, pixels: AnyArray | None) -> None:
    encoded, data = cv2.imencode(".png", pixels)
    assert encoded  # any picture of uint8 or uint16 can be a PNG
    write_whole(path, data.tobytes())
