"""The speed of the pipeline and its stages, as ratios to references timed in the same run.

Run it with ``python -m benchmarks.speed [--quick] [--docs PAGE]``. The references are

- Lee: ``skimage.morphology.skeletonize(method="lee")`` on the bounding box, most of what the authors' code costs;
- floor: OpenCV's 3 x 3 open and contours of the whole mask, next to nothing;
- paper: the published method, mask to curves.

"share" is what a stage takes of the whole time to tracked curves, on average.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from functools import partial
from itertools import cycle

import cv2
import numpy as np
from skimage.morphology import skeletonize

from benchmarks.docs import arguments, published
from benchmarks.machine import machine
from benchmarks.scenes import Mask, cables, film, photograph, swaying, to_and_fro
from benchmarks.timing import Table, interleaved
from dloftbs import Config, Frame, FrameResult, HsvRange, Pipeline
from dloftbs.config import SegmentationConfig
from dloftbs.segmentation import HsvSegmenter
from dloftbs_lab.synthetic import TYPICAL_NOISE, rgbd_artificial


def main() -> None:
    """Print the tables."""
    given = arguments(__doc__, "few rounds, to see that it runs").parse_args()
    rounds = 4 if given.quick else 500
    cv2.setNumThreads(1)
    with published("machine", given.docs):
        print(machine())
    with published("speed", given.docs):
        print(f"mask to curve, 1280 x 720, 12 px cables, one thread, {rounds} rounds\n")
        for count in (1, 5):
            masks = [cables(count, seed) for seed in range(4)]
            swaying_ones = [partial(swaying, mask) for mask in masks]
            compare_pipeline(f"{count} cable{'s' * (count > 1)}", masks, swaying_ones, rounds)
        films = [film(5, number, 4 if given.quick else 60) for number in range(4)]
        running = [partial(to_and_fro, masks) for masks in films]
        compare_pipeline("5 cables, freely moving", [masks[0] for masks in films], running, rounds)
        compare_segmentation(rounds)
        compare_lifting(rounds)


def compare_pipeline(
    title: str, masks: Sequence[Mask], moving: Sequence[Callable[[], Iterator[Mask]]], rounds: int
) -> None:
    """Time both methods on masks in turn and on these in motion, the default one by stage, too."""
    pipeline, paper = Pipeline(), Pipeline(Config.paper())
    stages: dict[str, list[float]] = {}
    boxes = [crop_to_box(mask) for mask in masks]
    # Each function has its own turn, so that all see all masks.
    turns = [cycle(masks) for _ in range(3)]
    each = max(rounds // len(masks), 1)
    ours, published_ones = (Streams([start() for start in moving], c, each) for c in (Config(), Config.paper()))
    box = cycle(boxes)

    def tracked() -> None:
        for stage, milliseconds in ours().stage_ms.items():
            stages.setdefault(stage, []).append(milliseconds)

    times = interleaved(
        {
            "alone": lambda: pipeline.detect(Frame(mask=next(turns[0]))),
            "tracked": tracked,
            "paper": lambda: paper.detect(Frame(mask=next(turns[1]))),
            "paper, tracked": published_ones,
            "floor": lambda: floor(next(turns[2])),
        },
        rounds,
    )
    # Lee's method is slow and even: fewer rounds, straight after.
    times |= interleaved({"Lee": lambda: skeletonize(next(box), method="lee")}, max(rounds // 10, 1))
    table = Table(title, {name: times[name] for name in ("Lee", "floor", "paper")}, times["tracked"])
    table.row("  mask to curves", times["alone"])
    table.row("  mask to tracked curves", times["tracked"])
    for stage, milliseconds in stages.items():
        table.row(f"    {stage}", np.array(milliseconds)[-rounds:], part=True)
    booked = np.sum([np.array(milliseconds)[-rounds:] for milliseconds in stages.values()], axis=0)
    table.row("    frame, result, between stages", times["tracked"] - booked, part=True)
    table.row("  published: mask to curves", times["paper"])
    table.row("  published: to tracked curves", times["paper, tracked"])
    table.row("  Lee's skeleton of the box", times["Lee"])
    table.row("  floor: open and contours", times["floor"])
    table.end()


def compare_segmentation(rounds: int) -> None:
    """Time colour to mask against OpenCV's two calls."""
    image = photograph()
    red = HsvRange(hue=(170, 10), saturation=(80, 255), value=(60, 255))
    segment = HsvSegmenter(SegmentationConfig(hsv=(red,)))

    def opencv() -> None:
        hsv = cv2.cvtColor(image, cv2.COLOR_BGR2HSV)
        cv2.inRange(hsv, (170, 80, 60), (179, 255, 255))

    times = interleaved({"ours": lambda: segment(image), "OpenCV": opencv}, rounds)
    table = Table("colour to mask, 1280 x 720", {"OpenCV": times["OpenCV"]})
    table.row("  ours, hue wrapping around 0", times["ours"])
    table.row("  cvtColor and one inRange", times["OpenCV"])
    table.end()


def compare_lifting(rounds: int) -> None:
    """Time depth to curves in space against all that the image alone takes."""
    lifted: dict[str, list[float]] = {}
    flat: list[float] = []
    for sequence in rgbd_artificial(0.05, noise=TYPICAL_NOISE):
        pipeline, frames = Pipeline(), [sequence.frame(i) for i in range(0, len(sequence), 3)]
        frame = cycle(frames)
        for _ in range(max(rounds // 4, 2 * len(frames))):
            times = dict(pipeline.detect(next(frame)).stage_ms)
            lifted.setdefault(sequence.name.partition(",")[0], []).append(times.pop("lifting"))
            flat.append(sum(times.values()))
    table = Table("depth to metres, 1280 x 720", {"2D": np.array(flat)})
    for name, milliseconds in lifted.items():
        table.row(f"  {name}", np.array(milliseconds))
    table.row("  all", np.concatenate([np.array(milliseconds) for milliseconds in lifted.values()]))
    table.end()


class Streams:
    """Masks that move, each followed by a pipeline of its own, some frames of one and then of the next."""

    def __init__(self, streams: Sequence[Iterator[Mask]], config: Config, frames: int) -> None:
        pairs = [(stream, Pipeline(config)) for stream in streams]
        self._turns = cycle([pair for pair in pairs for _ in range(frames)])

    def __call__(self) -> FrameResult:
        """Process the next frame."""
        stream, pipeline = next(self._turns)
        return pipeline.process(Frame(mask=next(stream)))


def floor(mask: Mask) -> None:
    """Do the least that any method would."""
    opened = cv2.morphologyEx(mask, cv2.MORPH_OPEN, np.ones((3, 3), np.uint8))
    cv2.findContours(opened, cv2.RETR_LIST, cv2.CHAIN_APPROX_NONE)


def crop_to_box(mask: Mask) -> Mask:
    """Cut a mask to its bounding box."""
    x, y, w, h = cv2.boundingRect(mask)
    return mask[y : y + h, x : x + w]


if __name__ == "__main__":
    main()
