"""How well cables are found by their surroundings, and by a picture of the empty place, and what that takes.

Run it with ``python -m benchmarks.segmentation_local [--seeds N]``. Cables are drawn round and glossy, with shadows, on
wood, steel and plain grounds, under an uneven lamp, with noise, as JPEG. The IoU is that of the union of cables; beside
it stands that of the best threshold of the brightness, which nobody can know. Times are those of an image of 1280 x 720
of a core at work, over those of ``cv2.cvtColor`` to HSV and ``cv2.inRange``.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable

import cv2
import numpy as np
import numpy.typing as npt

from benchmarks import segmentation_scenes as scenes
from benchmarks.segmentation_scenes import Image, Picture, Rng
from dloftbs.config import LocalConfig
from dloftbs.segmentation import BackgroundSegmenter, LocalSegmenter

_KINDS = {
    # ground, levels of the cable, its width
    "black, 10 px, wood": ("wood", 22.0, 10.0),
    "black, 10 px, steel": ("steel", 22.0, 10.0),
    "white, 10 px, steel": ("steel", 225.0, 10.0),
    "black, 3 px, before a screen": ("screen", 30.0, 3.0),
    "worm, 6 px, 15 levels darker": ("dish", 85.0, 6.0),
    "worm, 6 px, 8 levels darker": ("dish", 92.0, 6.0),
}
_DISH = 100.0  # levels of the ground of the worms
_RUNS = 20


def main() -> None:
    """Print two tables in Markdown."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, default=10)
    seeds = max(1, parser.parse_args().seeds)
    print("| cables | local | its worst | local, width given | background | its worst | best threshold |")
    print("| --- | ---: | ---: | ---: | ---: | ---: | ---: |")
    for number, (name, (ground, level, width_px)) in enumerate(_KINDS.items()):
        rows = [_scores(ground, level, width_px, np.random.default_rng([number, seed])) for seed in range(seeds)]
        local, given, background, best = np.array(rows).T
        cells = (local.mean(), local.min(), given.mean(), background.mean(), background.min(), best.mean())
        print(f"| {name} | " + " | ".join(f"{cell:.3f}" for cell in cells) + " |", flush=True)
    _print_times()


def _scores(ground: str, level: float, width_px: float, rng: Rng) -> tuple[float, ...]:
    empty = _ground(ground, rng)
    light = _lamp(rng)
    cables = scenes.drawn(empty, [np.full(3, level)] * 2, width_px, rng, 0.0) if width_px > 6.0 else None
    if cables is None:  # flat, without gloss and shadow
        cables = _flat(empty, level, width_px, rng)
    seen = Picture(_photographed(cables.image, light, rng), cables.labels)
    tone = "darker" if level < 128.0 else "brighter"
    masks = (
        LocalSegmenter(LocalConfig(tone=tone))(seen.image),
        LocalSegmenter(LocalConfig(tone=tone, width_px=width_px))(seen.image),
        BackgroundSegmenter(_photographed(empty, light * rng.uniform(0.9, 1.1), rng))(seen.image),
    )
    grey = cv2.cvtColor(seen.image, cv2.COLOR_BGR2GRAY)
    best = max(_iou((grey < at) != (tone == "brighter"), seen) for at in range(4, 252, 4))
    return (*(_iou(mask > 0, seen) for mask in masks), best)


def _ground(name: str, rng: Rng) -> Image:
    if name in ("wood", "steel"):
        return scenes.wood(rng) if name == "wood" else scenes.steel(rng)
    empty = np.full((*scenes.SIZE, 3), round(_DISH), np.uint8)
    if name == "screen":
        empty[:] = 70
        cv2.rectangle(empty, (150, 90), (520, 400), (165, 160, 150), -1)
    return empty


def _flat(empty: Image, level: float, width_px: float, rng: Rng) -> Picture:
    labels = scenes.drawn(empty, [np.full(3, level)] * 2, width_px, rng, 0.0).labels
    alpha = cv2.GaussianBlur((labels > 0).astype(np.float32), (0, 0), 0.6)[..., None]
    return Picture((alpha * level + (1.0 - alpha) * empty).round().astype(np.uint8), labels)


def _lamp(rng: Rng) -> npt.NDArray[np.float64]:
    """Return the light (H, W, 1) of a lamp: three times as much in its middle as far from it."""
    rows, columns = np.mgrid[: scenes.SIZE[0], : scenes.SIZE[1]]
    x, y = rng.uniform(0.2, 0.8, 2) * (scenes.SIZE[1], scenes.SIZE[0])
    away = np.hypot(columns - x, rows - y) / scenes.SIZE[1]
    return (0.4 + 0.8 * np.exp(-((away / 0.4) ** 2)))[..., None]


def _photographed(image: Image, light: npt.NDArray[np.float64], rng: Rng) -> Image:
    noisy = np.clip(image * light + rng.normal(0.0, 2.0, image.shape), 0.0, 255.0).round().astype(np.uint8)
    _, packed = cv2.imencode(".jpg", noisy, [cv2.IMWRITE_JPEG_QUALITY, 90])
    return np.asarray(cv2.imdecode(packed, cv2.IMREAD_COLOR), np.uint8)


def _iou(found: npt.NDArray[np.bool_], picture: Picture) -> float:
    true = picture.labels > 0
    return int(np.count_nonzero(found & true)) / max(int(np.count_nonzero(found | true)), 1)


def _print_times() -> None:
    cv2.setNumThreads(1)
    rng = np.random.default_rng(0)
    ground = scenes.steel(rng)
    picture = scenes.drawn(ground, [np.full(3, 22.0)] * 2, 10.0, rng, 0.0)
    image, empty = (cv2.resize(one, (1280, 720)) for one in (picture.image, ground))
    ways: dict[str, Callable[[], object]] = {
        "cvtColor and inRange": lambda: cv2.inRange(cv2.cvtColor(image, cv2.COLOR_BGR2HSV), (5, 40, 40), (22, 255, 255))
    }
    local, background = LocalSegmenter(LocalConfig(tone="darker")), BackgroundSegmenter(empty)
    ways |= {"local": lambda: local(image), "background": lambda: background(image)}
    taken: dict[str, list[float]] = {name: [] for name in ways}
    for _ in range(_RUNS):
        for name, way in ways.items():
            since = time.thread_time()
            way()
            taken[name].append(1e3 * (time.thread_time() - since))
    first = min(taken["cvtColor and inRange"])
    print("\n| way | least time, ms | ratio |\n| --- | ---: | ---: |")
    for name, times in taken.items():
        print(f"| {name} | {min(times):.1f} | {min(times) / first:.1f} |")


if __name__ == "__main__":
    main()
