"""Fit what a probability ahead of an end says, and measure what is read of networks' masks.

Run it in the repository with ``python -m benchmarks.soft_masks FOLDER``. The folder holds ``networks/ewd`` and
``networks/bwh``, photographs of cables and of harnesses with labelled pixels and the grey outputs of networks, and
``mbest/*/NN.jpg`` with ``NN.labels.png``. ``--write`` writes the page, and the fitted numbers; what is read is measured
with those of before, so that a second run states what they do.
"""

from __future__ import annotations

import argparse
import re
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

import cv2
import numpy as np
import numpy.typing as npt
from scipy.optimize import linear_sum_assignment

from benchmarks.fit_linking.confidence import fit_log_odds
from benchmarks.soft_masks.pixel_network import train
from dloftbs import Centerline, Detection, Frame, Pipeline
from dloftbs.kernels.shared.soft_masks import AHEAD_WIDTHS, ASIDE_WIDTHS
from dloftbs.linking import soft_end_weights, soft_existence_weights
from dloftbs.linking.kernels.soft_borders import least_ahead
from dloftbs.linking.soft_existence import reality_features
from dloftbs.pipeline.soft_mask import SURE, readings_of

DOCS = Path(__file__).parents[2] / "docs"

SOURCES = {
    "ResNet-101": "27 photographs of cables",
    "ResNet-50": "the same",
    "pixel network": "the same, each half of them by a network of ours that was trained on the other half",
    "pixel network, others": "30 photographs of mBEST by the same",
    "ResNet-101, branched": "15 photographs of harnesses; ends alone",
    "blurred": "labels of the 27, blurred by 2 px",
    "short": "40 drawings of three cables of 20 to 200 px and 4 to 16 px wide, blurred",
}
"""Sources of soft masks, and of what they are; the last two have nothing ahead of ends that are ends."""

_BRANCHED, _BLURRED, _SHORT = "ResNet-101, branched", "blurred", "short"
_OF_A_SOURCE = 100.0  # ends that each source counts for
_REAL = 0.5  # DICE of an object with a cable, from which on it is that cable
_STATED = 0.9
_MIN_ON = 0.3  # of an object on the cable that its ends are asked about
_EVERY_OTHER = 3  # photograph of others is used

Image = npt.NDArray[np.uint8]
Floats = npt.NDArray[np.float64]

_PAGE = """# Masks that are probabilities

For maintainers; [files](files.md) says how they are given. Made by `python -m benchmarks.soft_masks`.

A mask that is a probability is read at one half, a quarter, an eighth and a sixteenth. Each reading has the parts that
somewhere reach one half. It ends when the mean confidence of the objects is {sure:g}, or a sixteenth lies ahead
of no end. The reading with the highest mean is kept.

A gap of the mask is seen as cable if a sixteenth or more is a ridge along it. An end may have a ridge p ahead, beyond
its own soft border. It goes on with log-odds of {none:.2f} {per_log:+.2f} log(p + 1/256). This lowers
the confidence of its object, and so of its reading. Widths are those at half of the value along the cable.

| source | what | ends with something ahead | of them go on | stated | stated, left out | error, left out |
| --- | --- | ---: | ---: | ---: | ---: | ---: |
{ends}

The error is the mean of minus the logarithm of the stated probability of the true case. Stating the share that goes on
in all sources has {constant:.2f}.

The columns have the right number of cables, and the instance DICE over the larger number of objects. Then comes the
area under the curve of the confidence, of real objects (DICE above .5) against others. The last has the number of real
objects among those stated above .9.

Most objects that are not real are no ghosts: of ResNet-50's 14, 11 are pieces of cables, or run on along another cable
at a crossing. Against the three on no cable (DICE below .3) its area is .972, and ResNet-101's 1.000.

| source | read | right number | DICE | area | stated above .9 |
| --- | --- | ---: | ---: | ---: | ---: |
{results}
"""


_OBJECTS = """
An object is real with log-odds of {0:.2f} {1:+.2f} s {2:+.2f} w {3:+.2f} l. There, s are the log-odds of the mask along
the tenth of the axis where it is least sure. The logarithm of the width's standard deviation as a share of it is w.
That of the length as a share of the image's diagonal is l. That lowers `existence` and the confidence. Nothing is
dropped.

| source | objects | real | stated | area | stated, left out | area, left out |
| --- | ---: | ---: | ---: | ---: | ---: | ---: |
{rows}
"""


class Picture(NamedTuple):
    """A soft mask (H, W) and the pixels of each cable."""

    source: str
    soft: Image
    cables: list[npt.NDArray[np.bool_]]


class End(NamedTuple):
    """An end, of 256 what is nowhere missing ahead of it, and whether the cable goes on there."""

    source: str
    value: int
    goes_on: bool


class Object(NamedTuple):
    """An object that was found, what a soft mask says of it, and whether it is a cable."""

    source: str
    features: Floats
    is_real: bool


def main() -> None:
    """Fit, measure, and print or write the page and the numbers."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--write", action="store_true", help="write the numbers and the page")
    parser.add_argument("--pictures", type=int, help="most of each source, to see that it runs")
    given = parser.parse_args()
    pictures = list(list_pictures(given.folder, given.pictures))
    ends = [end for picture in pictures for end in list_ends(picture)]
    line = fit_ends(ends)
    objects = [one for picture in pictures for one in list_objects(picture)]
    existence = fit_objects(objects)
    if given.write:
        Path(soft_end_weights.__file__).write_text(write_weights(line))
        Path(soft_existence_weights.__file__).write_text(write_existence(existence))
    page = report(pictures, ends, line) + report_objects(objects, existence)
    print(page)
    if given.write:
        (DOCS / "soft-masks.md").write_text(page)


def list_pictures(folder: Path, most: int | None = None) -> Iterator[Picture]:
    """Yield the soft masks of all sources."""
    paths = sorted((folder / "networks" / "ewd").glob("*.labels.png"))[:most]
    stems = [path.name.removesuffix(".labels.png") for path in paths]
    labels = [_grey(path) for path in paths]
    images = [
        np.asarray(cv2.imread(str(path.with_name(f"{stem}.jpg"))), np.uint8)
        for path, stem in zip(paths, stems, strict=True)
    ]
    halves = [train(images[k::2], labels[k::2], seed=k) for k in range(2)]
    for k, (path, stem, label) in enumerate(zip(paths, stems, labels, strict=True)):
        cables = _cables(label)
        for source, network in (("ResNet-101", "r101"), ("ResNet-50", "r50")):
            yield Picture(source, _grey(path.with_name(f"{stem}.{network}.png")), cables)
        yield Picture("pixel network", halves[1 - k % 2](images[k]), cables)
        drawn = np.where(label > 0, np.uint8(255), np.uint8(0))
        yield Picture(_BLURRED, np.asarray(cv2.GaussianBlur(drawn, None, 2.0), np.uint8), cables)
    for path in sorted(folder.glob("mbest/*/*.jpg"))[::_EVERY_OTHER][:most]:
        image = np.asarray(cv2.imread(str(path)), np.uint8)
        yield Picture("pixel network, others", halves[0](image), _cables(_grey(path.with_suffix(".labels.png"))))
    for path in sorted((folder / "networks" / "bwh").glob("*.r101.png"))[:most]:
        hand = _grey(path.with_name(path.name.replace(".r101.", ".hand."))) > 0
        yield Picture(_BRANCHED, _grey(path), [hand])
    yield from (_short_cables(seed) for seed in range(40 if most is None else most))


def _short_cables(seed: int) -> Picture:
    """Draw short cables side by side, with borders as soft as networks make them."""
    rng = np.random.default_rng(seed)
    drawn = np.zeros((3, 360, 640), np.uint8)
    for k, plane in enumerate(drawn):
        along = np.linspace(-0.5, 0.5, 40) * rng.uniform(20.0, 200.0)
        bent = rng.uniform(-0.3, 0.3) * along**2 / 100.0
        points = np.stack([110.0 + 210.0 * k + bent, 180.0 + along], axis=1)
        cv2.polylines(plane, [np.rint(16.0 * points).astype(np.int32)], False, 255, int(rng.integers(4, 17)), shift=4)
    soft = cv2.GaussianBlur(drawn.max(axis=0), None, rng.uniform(0.7, 2.0))
    return Picture(_SHORT, np.asarray(soft, np.uint8), [plane > 0 for plane in drawn])


def _grey(path: Path) -> Image:
    return np.asarray(cv2.imread(str(path), cv2.IMREAD_UNCHANGED), np.uint8)


def _cables(labels: Image) -> list[npt.NDArray[np.bool_]]:
    return [labels == number for number in np.unique(labels) if number]


def list_ends(picture: Picture) -> Iterator[End]:
    """Yield the ends of the objects of all readings, each by itself, ahead of which there is something."""
    if picture.source == _SHORT:
        return
    pipeline = Pipeline()
    for limit, mask in readings_of(picture.soft):
        for found in pipeline.detect(Frame(mask=mask)):
            line = found.centerline
            drawn = draw(found, picture.soft.shape)
            on = [int(np.sum(drawn & cable)) for cable in picture.cables]
            if line.closed or max(on) < _MIN_ON * np.sum(drawn):
                continue
            cable = picture.cables[int(np.argmax(on))]
            for at_end in (False, True):
                value = least_ahead(line.points, at_end, picture.soft, line.width_px, limit)
                if value >= 1:
                    yield End(picture.source, value, _goes_on(line, at_end, cable))


def _goes_on(line: Centerline, at_end: bool, cable: npt.NDArray[np.bool_]) -> bool:
    """Return whether the pixels of a cable lie across each place ahead of an end."""
    points = line.points[::-1] if at_end else line.points
    ahead = points[0] - points[min(int(np.ceil(AHEAD_WIDTHS[-1] * line.width_px)), len(points) - 1)]
    ahead = ahead / np.linalg.norm(ahead) * line.width_px
    along, aside = np.array(AHEAD_WIDTHS)[:, None, None], np.array(ASIDE_WIDTHS)[:, None]
    x, y = np.floor(points[0] + along * ahead + aside * np.array([-ahead[1], ahead[0]]) + 0.5).astype(int).T
    return bool(cable[y, x].any(axis=0).all())


def fit_ends(ends: Sequence[End]) -> Floats:
    """Return the log-odds that a cable goes on where 255 is ahead of its end, and what a unit of the logarithm adds.

    Sources count alike.
    """
    counts = {source: sum(end.source == source for end in ends) for source in SOURCES}
    weights = np.array([_OF_A_SOURCE / counts[end.source] for end in ends])
    return fit_log_odds(_columns(ends), np.array([end.goes_on for end in ends]), weights)


def state_ends(ends: Sequence[End], line: Floats) -> Floats:
    """Return the probability that a line gives each end to go on."""
    stated: Floats = 1.0 / (1.0 + np.exp(-_columns(ends) @ line))
    return stated


def _columns(ends: Sequence[End]) -> Floats:
    return np.array([(1.0, np.log((end.value + 1) / 256.0)) for end in ends])


def draw(found: Detection, size: tuple[int, ...]) -> npt.NDArray[np.bool_]:
    """Return the pixels of an object, drawn as wide as it is."""
    drawn = np.zeros(size, np.uint8)
    points = np.rint(16.0 * found.curve.sample(max(int(found.curve.length), 2))).astype(np.int32)
    cv2.polylines(drawn, [points], False, 1, max(round(found.width_px), 1), shift=4)
    return drawn > 0


def report(pictures: Sequence[Picture], ends: Sequence[End], line: Floats) -> str:
    """Return the page, in Markdown."""
    rows = []
    for source, what in SOURCES.items():
        own = [end for end in ends if end.source == source]
        if not own:
            rows.append(f"| {source} | {what} | 0 | | | | |")
            continue
        others = fit_ends([end for end in ends if end.source != source])
        goes_on = np.array([end.goes_on for end in own])
        stated, left_out = state_ends(own, line), state_ends(own, others)
        loss = -np.log(np.where(goes_on, left_out, 1.0 - left_out)).mean()
        rows.append(
            f"| {source} | {what} | {len(own)} | {goes_on.mean():.2f} | {stated.mean():.2f} | {left_out.mean():.2f} | "
            f"{loss:.2f} |"
        )
    shares = [np.mean([end.goes_on for end in ends if end.source == one]) for one in {end.source for end in ends}]
    share = float(np.mean(shares))
    constant = -np.mean([one * np.log(share) + (1.0 - one) * np.log(1.0 - share) for one in shares])
    results = [
        f"| {source} | {name} | {' | '.join(_scores([one for one in pictures if one.source == source], frame))} |"
        for source in SOURCES
        if source != _BRANCHED
        for name, frame in _WAYS.items()
    ]
    return _PAGE.format(
        sure=SURE, none=line[0], per_log=line[1], ends="\n".join(rows), constant=constant, results="\n".join(results)
    )


_WAYS: dict[str, Callable[[Image], Frame]] = {
    "at one half": lambda soft: Frame(mask=soft >= 128),
    "as a probability": lambda soft: Frame(mask=soft, mask_is="probability"),
}


def _scores(pictures: Sequence[Picture], frame: Callable[[Image], Frame]) -> list[str]:
    """Return the cells of a row of results."""
    pipeline = Pipeline()
    right, dices, stated, real = [], [], [], []
    for picture in pictures:
        found = pipeline.detect(frame(picture.soft))
        drawn = [draw(one, picture.soft.shape) for one in found]
        dice = np.array([[_dice(one, cable) for cable in picture.cables] for one in drawn])
        dice = dice.reshape(len(drawn), len(picture.cables))
        right.append(len(found) == len(picture.cables))
        dices.append(dice[linear_sum_assignment(-dice)].sum() / max(dice.shape))
        stated += [one.confidence for one in found]
        real += (dice.max(axis=1) > _REAL).tolist()
    sure, is_real = np.array(stated), np.array(real, np.bool_)
    area = area_of(sure, is_real)
    of_sure = is_real[sure > _STATED]
    return [f"{np.mean(right):.3f}", f"{np.mean(dices):.3f}", area, f"{of_sure.mean():.2f} of {len(of_sure)}"]


def _dice(one: npt.NDArray[np.bool_], other: npt.NDArray[np.bool_]) -> float:
    return 2.0 * float(np.sum(one & other)) / float(np.sum(one) + np.sum(other))


def list_objects(picture: Picture) -> Iterator[Object]:
    """Yield the objects that are read of a soft mask."""
    if picture.source == _BRANCHED:
        return
    for found in Pipeline().detect(Frame(mask=picture.soft, mask_is="probability")):
        drawn = draw(found, picture.soft.shape)
        is_real = max(_dice(drawn, cable) for cable in picture.cables) > _REAL
        yield Object(picture.source, reality_features(found.centerline, picture.soft), is_real)


def fit_objects(objects: Sequence[Object]) -> Floats:
    """Return the log-odds that an object is real, and what each feature adds; sources count alike."""
    counts = {source: sum(one.source == source for one in objects) for source in SOURCES}
    weights = np.array([_OF_A_SOURCE / counts[one.source] for one in objects])
    return fit_log_odds(
        np.stack([one.features for one in objects]), np.array([one.is_real for one in objects]), weights
    )


def report_objects(objects: Sequence[Object], line: Floats) -> str:
    """Return the part of the page on objects, in Markdown."""
    rows = []
    for source in SOURCES:
        own = [one for one in objects if one.source == source]
        if not own:
            continue
        features, is_real = np.stack([one.features for one in own]), np.array([one.is_real for one in own])
        others = fit_objects([one for one in objects if one.source != source])
        stated, left_out = (1.0 / (1.0 + np.exp(-features @ by)) for by in (line, others))
        areas = [area_of(one, is_real) for one in (stated, left_out)]
        rows.append(
            f"| {source} | {len(own)} | {is_real.mean():.2f} | {stated.mean():.2f} | {areas[0]} | "
            f"{left_out.mean():.2f} | {areas[1]} |"
        )
    return _OBJECTS.format(*line, rows="\n".join(rows))


def area_of(stated: Floats, is_real: npt.NDArray[np.bool_]) -> str:
    """Return the area under the curve of what is stated of real objects, against others."""
    above = stated[is_real][:, None] - stated[~is_real]
    return f"{((above > 0) + 0.5 * (above == 0)).mean():.3f}" if above.size else "-"


def write_existence(line: Floats) -> str:
    """Return the module of what is fitted of objects."""
    numbers = ", ".join(f"{number:.2f}" for number in line)
    return re.sub(r"IS_REAL = .*", f"IS_REAL = ({numbers})", Path(soft_existence_weights.__file__).read_text())


def write_weights(line: Floats) -> str:
    """Return the module of what is fitted."""
    numbers = ", ".join(f"{number:.2f}" for number in line)
    return (
        '"""Odds that a cable goes on, by what is ahead of its end; made by ``python -m benchmarks.soft_masks``.\n\n'
        "docs/soft-masks.md has what they were fitted to, and the results on each source left out.\n"
        '"""\n\nfrom __future__ import annotations\n\n'
        f"GOES_ON = ({numbers})\n"
        '"""Log-odds that a cable goes on where all is sure ahead of its end, and per unit of its logarithm.\n\n'
        'Source: fitted; see docs/soft-masks.md.\n"""\n'
    )


if __name__ == "__main__":
    main()
