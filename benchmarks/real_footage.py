"""What the default method makes of small inputs from real footage, beside what is right for each.

Run it with ``python -m benchmarks.real_footage DATA``. The folder holds ``cases/NAME`` with masks, and ``truth.json``
where centre lines are known, and ``networks/ewd`` with ``NAME.NETWORK.png``, the grey output of a segmentation network,
beside ``NAME.labels.png``, whose pixel value is the cable's number. Prints a row per input: the expectation, the
result, and whether it is right; then the pictures of each network with the right number of cables, and the photographs
in ``mbest`` as `benchmarks.photographs` scores them. Cases that are not there are left out, with a word.
`benchmarks.original_curves` and ``dloftbs evaluate FOLDER`` score other data.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
import numpy.typing as npt
from scipy.optimize import linear_sum_assignment

import dloftbs
from benchmarks.photographs import score
from dloftbs_lab.evaluation import mmd

Points = npt.NDArray[np.float64]
Mask = npt.NDArray[np.bool_]

NETWORKS = ("r101", "r50")
HALF = 128
"""Grey value from which a network's output counts as cable: a probability of one half."""
_SAMPLES = 1500
_NEAR_PX = 12.0
"""Half the width of the cable of `fringe_crossing`, rounded up: an end within this of the border's place is there."""
_SPECK_PX = 30.0
"""Longest curve that counts as a speck beside the worm: those of its frames are 10 to 25 px long."""


@dataclass(frozen=True)
class Row:
    """One input: the expectation and the result in words, and whether they agree."""

    case: str
    expected: str
    found: str
    right: bool


Check = Callable[[Path], Iterator[Row]]


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("data", type=Path)
    parser.add_argument("--only", metavar="NAME", help="a case's name, or a part of it; without networks")
    given = parser.parse_args()
    print("| case | expected | found | |")
    print("| --- | --- | --- | --- |")
    rows = []
    for name, check in CASES.items():
        if given.only is not None and given.only not in name:
            continue
        if not (given.data / "cases" / name).is_dir():
            print(f"| {name} | | no such folder: left out | - |")
            continue
        for row in check(given.data / "cases" / name):
            rows.append(row)
            print(f"| {row.case} | {row.expected} | {row.found} | {'right' if row.right else 'WRONG'} |", flush=True)
    print(f"\n{sum(row.right for row in rows)} of {len(rows)} rows right\n")
    if given.only is None:
        _print_networks(given.data / "networks" / "ewd")
        _print_photographs(given.data / "mbest")


def read_mask(file: Path, least: int = 1) -> Mask:
    """Return the pixels of a grey picture that are at least so bright, shape (H, W)."""
    grey = cv2.imread(str(file), cv2.IMREAD_GRAYSCALE)
    if grey is None:
        raise SystemExit(f"{file} cannot be read as a picture")
    return np.asarray(grey >= least)


def truth_of(folder: Path) -> list[Points]:
    """Return the centre lines (n, 2) px of a case."""
    return [np.array(curve, np.float64) for curve in json.loads((folder / "truth.json").read_text("utf-8"))["curves"]]


def beside_truth(result: dloftbs.FrameResult, truth: Sequence[Points]) -> tuple[str, bool]:
    """Return how far curves lie from true ones, and whether each true one has one within half a width of its own."""
    lines = [_refined(points) for points in truth]
    if not result.detections:
        return "nothing found", False
    curves = [detection.curve.sample(_SAMPLES) for detection in result.detections]
    there = np.array([[mmd(line, curve) for curve in curves] for line in lines])
    back = np.array([[mmd(curve, line) for curve in curves] for line in lines])
    worse = np.maximum(there, back)
    pairs = list(zip(*linear_sum_assignment(worse), strict=True))
    right = len(pairs) == len(lines) == len(curves)
    right &= all(worse[i, j] <= result.detections[j].width_px / 2.0 for i, j in pairs)
    return "off by " + ", ".join(f"{worse[i, j]:.1f}" for i, j in pairs) + " px", right


def _in_words(result: dloftbs.FrameResult) -> str:
    lengths = sorted((detection.curve.length for detection in result.detections), reverse=True)
    listed = ", ".join(f"{length:.0f}" for length in lengths[:6]) + (", ..." if len(lengths) > 6 else "")
    crossings = f", {len(result.crossings)} crossings" if result.crossings else ""
    return f"{len(lengths)} curves: {listed} px{crossings}" if lengths else f"none: {result.reason}"


def fringe_crossing(folder: Path) -> Iterator[Row]:
    """Two curves straight through a crossing, and the figure of eight that it is cut from as one."""
    result = dloftbs.detect(read_mask(folder / "crossing.png"))
    ways = (((128.0, 400.0), (310.0, -1.0)), ((8.0, 0.0), (400.0, 370.0)))
    through = sum(any(_joins(detection, *way) for way in ways) for detection in result.detections)
    found = f"{_in_words(result)}; {through} go through"
    yield Row("fringe: crossing", "2 curves, both through", found, len(result) == through == 2)
    result = dloftbs.detect(read_mask(folder / "mask.png"))
    yield Row("fringe: figure of eight", "1 curve", _in_words(result), len(result) == 1)


def _joins(detection: dloftbs.Detection, a: tuple[float, float], b: tuple[float, float]) -> bool:
    ends = detection.curve.sample(2)
    return any(bool((np.linalg.norm(ends - np.array(pair), axis=1) <= _NEAR_PX).all()) for pair in ((a, b), (b, a)))


def steady_cable(folder: Path) -> Iterator[Row]:
    """One id, one direction and one length in all frames of a video."""
    results = _tracked(sorted(folder.glob("*.png")), 20.0)
    ids = {track.id for result in results for track in result.tracks}
    tracks = [track for result in results for track in result.tracks]
    off = sum(
        not (len(result.tracks) == 1 and abs(round(result.tracks[0].curve.length) - 839) <= 5) for result in results
    )
    flips = sum(
        abs(float(track.curve.sample(2)[0, 0]) - 1060.0) > abs(float(track.curve.sample(2)[1, 0]) - 1060.0)
        for track in tracks
        if track.curve.length > 500.0
    )
    found = f"{len(ids)} ids, {off} frames wrong, {flips} reversed"
    yield Row(
        f"ragged video: {len(results)} frames",
        "1 id, 839 +- 5 px, starts at x = 1060",
        found,
        not off + flips and len(ids) == 1,
    )


def _tracked(files: Sequence[Path], fps: float) -> list[dloftbs.FrameResult]:
    frames = (
        dloftbs.Frame(mask=read_mask(file), index=number, stamp=number / fps, name=file.name)
        for number, file in enumerate(files)
    )
    return list(dloftbs.track(frames))


def highlights(folder: Path) -> Iterator[Row]:
    """Two cables, whatever pin-holes there are."""
    result = dloftbs.detect(read_mask(folder / "mask.png"))
    off, right = beside_truth(result, truth_of(folder))
    yield Row("highlight: whole picture", "2 curves, to half a width", f"{_in_words(result)}; {off}", right)
    result = dloftbs.detect(read_mask(folder / "crop-that-works.png"))
    yield Row("highlight: cut", "2 curves", _in_words(result), len(result) == 2)


def open_slit(folder: Path) -> Iterator[Row]:
    """One curve along the middle of the outer edges."""
    result = dloftbs.detect(read_mask(folder / "mask.png"))
    off, right = beside_truth(result, truth_of(folder))
    yield Row("slit open at the border", "1 curve, to half a width", f"{_in_words(result)}; {off}", right)


def end_rings(folder: Path) -> Iterator[Row]:
    """One curve without rings at its ends, whatever lies at the border, with and without the return of thin parts."""
    without: Mapping[str, object] = {"cleaning": {"thin_px": 0}}
    for name in ("mask", "mask-without-the-strip-at-the-border"):
        for words, config in (("", None), (", thin_px=0", without)):
            result = dloftbs.detect(read_mask(folder / f"{name}.png"), config=config)
            near = [d for d in result.detections if abs(d.curve.length - 794.0) <= 10.0]
            off, right = beside_truth(result, truth_of(folder))
            # The strip at the border may be a curve of its own: nothing says that it is none.
            right = len(near) == 1 and not result.crossings and (right or len(result) == 2)
            yield Row(f"end ring: {name}{words}", "1 curve, 794 px, no ring", f"{_in_words(result)}; {off}", right)


def dashes(folder: Path) -> Iterator[Row]:
    """As many curves as there are lines."""
    for start, counts in (("Hard-uvs09", (1,)), ("Hard-uvs24", (3,)), ("Hard-uvs13", (4, 5)), ("Easy-Candamo09", (4,))):
        for file in sorted(folder.glob(f"{start}*.png")):
            mask = read_mask(file)
            result = dloftbs.detect(mask)
            covered = _covered(mask, result)
            found = f"{_in_words(result)}; {100 * covered:.0f} % of the mask covered"
            expected = f"{' or '.join(map(str, counts))} curves, 90 % covered"
            yield Row(f"dashes: {start}", expected, found, len(result) in counts and covered >= 0.9)


def _covered(mask: Mask, result: dloftbs.FrameResult) -> float:
    """Return the share of a mask's pixels (H, W) within 2 px of a curve."""
    rows, columns = np.nonzero(mask)
    if not result.detections:
        return 0.0
    curves = np.concatenate([detection.curve.sample(_SAMPLES) for detection in result.detections])
    distance = np.array([np.hypot(*(curves - place).T).min() for place in np.column_stack((columns, rows))])
    return float(np.mean(distance <= 2.0))


def worm(folder: Path) -> Iterator[Row]:
    """A worm of 65 px beside specks, in single frames and followed."""
    files = sorted(folder.glob("*.png"))
    for file in files:
        if file.stem not in ("435", "513", "529", "551"):
            continue
        result = dloftbs.detect(read_mask(file))
        yield Row(f"worm: {file.stem}", "65 +- 6 px, and specks", _in_words(result), _is_worm(result))
    right = sum(_is_worm(dloftbs.detect(read_mask(file))) for file in files)
    yield Row("worm: single frames", f"{len(files)} of {len(files)}", f"{right} right", right == len(files))
    result = dloftbs.detect(read_mask(folder / "551.png"), objects=1)
    yield Row("worm: 551, objects=1", "1 curve, 65 +- 6 px", _in_words(result), len(result) == 1 and _is_worm(result))
    results = _tracked([file for file in files if 545 <= int(file.stem) <= 562], 15.0)
    long = [[track for track in result.tracks if track.curve.length > _SPECK_PX] for result in results]
    off = sum(not (len(tracks) == 1 and abs(tracks[0].curve.length - 65.0) <= 6.0) for tracks in long)
    ids = {track.id for tracks in long for track in tracks}
    lengths = [track.curve.length for tracks in long for track in tracks]
    found = f"{len(ids)} ids, {off} frames wrong, {min(lengths):.0f} to {max(lengths):.0f} px"
    yield Row(f"worm: track, {len(results)} frames", "1 id, 65 +- 6 px", found, not off and len(ids) == 1)


def _is_worm(result: dloftbs.FrameResult) -> bool:
    long = [detection.curve.length for detection in result.detections if detection.curve.length > _SPECK_PX]
    return len(long) == 1 and abs(long[0] - 65.0) <= 6.0


CASES: Mapping[str, Check] = {
    "fringe-breaks-crossing": fringe_crossing,
    "flip-from-ragged-mask": steady_cable,
    "highlight-hole-many-pinholes": highlights,
    "slit-open-at-border": open_slit,
    "end-ring": end_rings,
    "dashed-network-mask": dashes,
    "worm-debris": worm,
}


def network_count(folder: Path, network: str, *, with_image: bool) -> tuple[int, int]:
    """Return the pictures with the right number of cables by a network's masks, and the number of pictures."""
    files = sorted(folder.glob(f"*.{network}.png"))
    right = 0
    for file in files:
        stem = file.name.removesuffix(f".{network}.png")
        labels = np.asarray(cv2.imread(str(folder / f"{stem}.labels.png"), cv2.IMREAD_GRAYSCALE))
        image = np.asarray(cv2.imread(str(folder / f"{stem}.jpg")), np.uint8) if with_image else None
        result = dloftbs.Pipeline().detect(dloftbs.Frame(image=image, mask=read_mask(file, HALF)))
        right += len(result) == len(np.unique(labels[labels > 0]))
    return right, len(files)


def _print_networks(folder: Path) -> None:
    if not folder.is_dir():
        print("no masks of networks: left out")
        return
    print("| networks' masks | right number, mask alone | with the photograph |")
    print("| --- | ---: | ---: |")
    for network in NETWORKS:
        counts = [network_count(folder, network, with_image=with_image) for with_image in (False, True)]
        print(f"| {network} | {' | '.join(f'{right} of {number}' for right, number in counts)} |", flush=True)


def _print_photographs(folder: Path) -> None:
    if not folder.is_dir():
        print("\nno photographs with labels: left out")
        return
    print("\n| photographs | right number | DICE | worst |")
    print("| --- | ---: | ---: | ---: |")
    for part in sorted(path for path in folder.iterdir() if path.is_dir()):
        scores = [score(dloftbs.Pipeline(), path) for path in sorted(part.glob("*.jpg"))]
        dices = [dice for _, dice in scores]
        right = sum(right for right, _ in scores)
        print(f"| {part.name} | {right} of {len(scores)} | {np.mean(dices):.4f} | {min(dices):.4f} |", flush=True)


def _refined(points: Points, step_px: float = 1.0) -> Points:
    """Return points about so far apart on a polyline (n, 2)."""
    arc = np.concatenate(([0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))))
    places = np.linspace(0.0, arc[-1], max(2, round(arc[-1] / step_px) + 1))
    return np.column_stack([np.interp(places, arc, axis) for axis in points.T])


if __name__ == "__main__":
    main()
