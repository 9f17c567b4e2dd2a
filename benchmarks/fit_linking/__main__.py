"""Fit the weights of linking, the confidence of its joints, or the existence of its objects, to labelled scenes.

Run it in the repository with ``python -m benchmarks.fit_linking weights FOLDER``, then with ``confidence``, and with
``existence``, for which it holds ``networks/ewd`` and ``networks/bwh``, too. The
folder holds ``cables/NNNNN.txt`` with points along each cable, ``NNNNN.jpg`` and ``NNNNN_mask_all.png``, as the data
set of Ariadne has them; ``mbest/*/NN.labels.png`` with ``NN.jpg``, whose pixel value is the cable's number, as that of
mBEST; ``masks/NNN.png`` with ``masks/original_curves.json``, masks of one cable each and points along it; and
recordings in ``motion``. Either prints a page of the documents; ``--write`` writes it, and the fitted numbers. Without
the simulator or one of these nothing is fitted.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

import numpy as np

from benchmarks.fit_linking.confidence import Claim, calibration_error, fit_crossings, fit_gaps, list_claims, state
from benchmarks.fit_linking.existence import (
    NETWORKS,
    PIECES,
    Found,
    fit_existence,
    list_objects,
    networks_scenes,
    piece_scenes,
    state_existence,
)
from benchmarks.fit_linking.model import ALWAYS_HELD, Fit, count_wrong, fit, mean_loss
from benchmarks.fit_linking.readings import Choice, Floats, list_choices
from benchmarks.fit_linking.scenes import FIXED, GAP_SOURCES, SOURCES, list_scenes
from dloftbs.config import LinkingConfig
from dloftbs.linking import calibration, existence_weights
from dloftbs.linking.kernels import weights as in_use
from dloftbs.linking.kernels.joint_features import GAP_ROUND

DOCS = Path(__file__).parents[2] / "docs" / "maintainers"

COLUMNS = {
    "LINK_TURN": "turn through a junction, as a bend, rad²",
    "LINK_SWERVE": "swerve through a junction, as a bend, rad²",
    "GAP_ENERGY": "bend across a gap over its length, rad² a width",
    "GAP_LENGTH": "length of a gap, widths",
    "GAP_ROUND": "roundness of both ends of a gap that is no break of the mask",
    "DEPTH_SWERVE": "how unlike a cable's swerve towards the camera or away from it is, nats",
    "OTHER_COLOUR": "cables before both ends that differ clearly in colour",
    "GAP_SEEN": "what image and depth say for a gap, nats",
    "OPEN_JUNCTION": "an end left open at a junction",
    "OPEN_KINK": "an end left open at a sharp turn",
    "OPEN_FREE": "a free end left open",
}
"""What each column is, in their order; those of joints come first."""

_FITTED = [name for column, name in enumerate(COLUMNS) if column not in ALWAYS_HELD]
_SEEDS = {"weights": (1, 2), "confidence": (101, 102), "existence": (201, 202)}
_PIECE_SCENES = 400  # of each seed
_SURE, _LIKELY = 0.99, (0.9, 0.95)

_ON_WEIGHTS = """# The weights of linking

For maintainers; [how linking decides](../linking.md) says what they mean. Made by `python -m benchmarks.fit_linking
weights`.

A choice is a set of branch ends that may be joined with each other, with all its readings. The odds of a reading are e
to the power of minus its cost, and the weights are those under which the true readings are the most probable. Sources
count alike, as far as they have enough. Hidden cables count three times, and the few real masks that are broken
four times. That balance is set by hand. It is between gaps behind which one cable goes on and ends of two cables that
face each other; a mask alone does not distinguish these. A weight without a deviation is held: it is counted, or that
of log-odds, or of an earlier fit to all sources (`--only` names those that are fitted). No
source is left out of weights that are held.
"""
_ON_CONFIDENCE = """# The confidence of joints

For maintainers; [how linking decides](../linking.md) says what it means. Made by `python -m benchmarks.fit_linking
confidence`, of other scenes than the [weights](linking-weights.md).

The confidence of a joint is the probability that it is right. Its log-odds depend on its margin m and its cost c,
nats. Those of a gap depend on its margin and on its sides. Here s is the logarithm of the length of the longer side in
widths, and t that of the ratio of the widths of both sides. The log-odds are
{lines}.
Those of a gap are at most the margin. That of a cable is the product of its joints' and its ends'; a right cable lies
on one true curve. Each crossing counts alike. Gaps are fitted to sources with debris, dashes and stubs alone, which
count alike, but networks' masks three times, by hand: they have most of the objects. A gap below
`linking.min_gap_confidence` stays open; here all count. The table is of joints with the source left out of the fit. It
has the mean stated confidence, the share that is right, the mean distance between the two, over bins, and the share
that is right of those stated between .9 and .95. Left out, the networks are off the most: no other source has stubs
that are thinner than the cable they belong to.

With a mask alone, a gap between two ends that face each other looks the same whether something hides the cable or two
cables end there. Of the drawn ones none is right, of those behind discs nearly all are: no number serves both.

| what | source | number | stated | right | error | right of .9 to .95 | wrong above .99 |
| --- | --- | ---: | ---: | ---: | ---: | ---: | ---: |
"""

_ON_EXISTENCE = """# The existence of objects

For maintainers; [how linking decides](../linking.md) says what it means. Made by `python -m benchmarks.fit_linking
existence`.

The existence of an object is the probability that it is a cable at all, and no debris or error of the segmentation. Its
log-odds are {none:.2f} {per_log:+.2f} log s, where s is its size, the diagonal of its box times its width, as a share
of the largest object's; the largest is a cable. Sources count alike, and all networks together as one; masks alone. An
object below `linking.min_probability`, {least:g}, is dropped: that is one below {limit:.1f} % of the largest size.
Hardly any other source has objects that are no cables, so that one network is left out at a time: the last column has
what a fit to all other sources drops.

| source | objects but the largest | cables | stated | no cables dropped | cables dropped | the same, left out |
| --- | ---: | ---: | ---: | ---: | ---: | ---: |
"""


def main() -> None:
    """Collect the scenes, fit, and print or write the page and the numbers."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("what", choices=tuple(_SEEDS))
    parser.add_argument("photographs", type=Path)
    parser.add_argument("--write", action="store_true", help="write the numbers and the page")
    parser.add_argument("--only", nargs="+", choices=_FITTED, help="weights to fit, the others are held as they are")
    parser.add_argument("--amount", type=float, default=1.0, help="share of the scenes, to see that it runs")
    given = parser.parse_args()
    if given.only and given.what != "weights":
        parser.error(f"--only is for weights, not for {given.what}")
    seeds = _SEEDS[given.what]
    if given.what == "existence":
        _run_existence(given.photographs, given.amount, write=given.write)
        return
    options = given.amount, given.photographs
    sources = SOURCES if given.what == "weights" else list({**SOURCES, **GAP_SOURCES})
    tasks = [
        (source, seed, *options) for source in sources for seed in seeds if source not in FIXED or seed == seeds[0]
    ]
    with ProcessPoolExecutor() as pool:
        if given.what == "weights":
            choices = [choice for part in pool.map(_choices, *zip(*tasks, strict=True)) for choice in part]
            held = [column for column, name in enumerate(COLUMNS) if given.only and name not in given.only]
            held = sorted({*held, *ALWAYS_HELD})
            found = fit(choices, held)
            page, code, target = report_weights(choices, found, held), write_weights(found), Path(in_use.__file__)
        else:
            claims = [claim for part in pool.map(_claims, *zip(*tasks, strict=True)) for claim in part]
            lines = {kind: fit_line(claims, kind) for kind in ("crossing", "gap")}
            page, code, target = report_confidence(claims, lines), write_lines(lines), Path(calibration.__file__)
    print(page)
    if given.write:
        (DOCS / f"linking-{given.what}.md").write_text(page)
        target.write_text(code)


def _choices(source: str, seed: int, amount: float, photographs: Path) -> list[Choice]:
    return list(list_choices(list_scenes(source, seed, amount, photographs)))


def _claims(source: str, seed: int, amount: float, photographs: Path) -> list[Claim]:
    return list(list_claims(list_scenes(source, seed, amount, photographs)))


def _run_existence(folder: Path, amount: float, *, write: bool) -> None:
    """Fit the existence of objects, and print or write the page and the numbers."""
    seeds = _SEEDS["existence"]
    tasks = [
        (name, seed, amount, folder) for name in SOURCES for seed in seeds if name not in FIXED or seed == seeds[0]
    ]
    with ProcessPoolExecutor() as pool:
        objects = [one for part in pool.map(_objects, *zip(*tasks, strict=True)) for one in part]
    objects += list_objects(networks_scenes(folder))
    for seed in seeds:
        objects += list_objects(piece_scenes(seed, max(round(_PIECE_SCENES * amount), 1)))
    line = fit_existence(objects)
    page = report_existence(objects, line)
    print(page)
    if write:
        (DOCS / "linking-existence.md").write_text(page)
        Path(existence_weights.__file__).write_text(write_existence(line))


def _objects(source: str, seed: int, amount: float, photographs: Path) -> list[Found]:
    return list(list_objects(list_scenes(source, seed, amount, photographs)))


def report_existence(objects: Sequence[Found], line: Floats) -> str:
    """Return the page on the existence of objects, in Markdown."""
    least = LinkingConfig().min_probability
    rows = []
    for source in (*SOURCES, PIECES, *NETWORKS):
        own = [one for one in objects if one.source == source]
        if not own:
            continue
        cables = np.array([one.is_cable for one in own])
        others = fit_existence([one for one in objects if one.source != source])
        stated, left_out = state_existence(own, line), state_existence(own, others)
        cells = [
            f"{(one[~cables] < least).sum()} of {(~cables).sum()} | {(one[cables] < least).sum()}"
            for one in (stated, left_out)
        ]
        rows.append(
            f"| {source} | {len(own)} | {cables.sum()} | {stated.mean():.3f} | {cells[0]} | "
            f"{cells[1].replace(' | ', ', ')} |"
        )
    limit = 100.0 * np.exp((np.log(least / (1.0 - least)) - line[0]) / line[1])
    return _ON_EXISTENCE.format(none=line[0], per_log=line[1], least=least, limit=limit) + "\n".join(rows) + "\n"


def report_weights(choices: Sequence[Choice], found: Fit, held: Sequence[int] = ALWAYS_HELD) -> str:
    """Return the page on the weights, in Markdown."""
    by_source = {name: [choice for choice in choices if choice.source == name] for name in SOURCES}
    lines = [_ON_WEIGHTS, "| source | what | choices |", "| --- | --- | ---: |"]
    lines += [f"| {name} | {what} | {len(by_source[name])} |" for name, what in SOURCES.items()]
    lines += ["", "| column | nats a unit | deviation |", "| --- | ---: | ---: |"]
    lines += [
        f"| `{name}`: {what} | {weight:.2f} | {f'{deviation:.2f}' if deviation else ''} |"
        for (name, what), weight, deviation in zip(COLUMNS.items(), found.weights, found.deviations, strict=True)
    ]
    lines += [
        "",
        "Number of choices that are read wrongly, and in brackets the mean of minus the logarithm of the true",
        "reading's probability: with all sources, with the source left out of the fit, and without the shape of ends.",
        "",
        "| source | all | left out | without end shape |",
        "| --- | ---: | ---: | ---: |",
    ]
    blind = fit(_without(choices, GAP_ROUND), held)
    for name, own in by_source.items():
        others = fit([choice for choice in choices if choice.source != name], held)
        cells = [_cell(own, found), _cell(own, others), _cell(_without(own, GAP_ROUND), blind)]
        lines.append(f"| {name} | {' | '.join(cells)} |")
    return "\n".join(lines) + "\n"


def _without(choices: Sequence[Choice], column: int) -> list[Choice]:
    """Return the choices with one column that tells nothing."""
    kept = []
    for choice in choices:
        rows = choice.rows.copy()
        rows[:, column] = 0.0
        kept.append(Choice(choice.source, rows, choice.true))
    return kept


def _cell(choices: Sequence[Choice], found: Fit) -> str:
    return f"{count_wrong(choices, found.weights)} ({mean_loss(choices, found.weights):.3f})"


def fit_line(claims: Sequence[Claim], kind: str, without: str | None = None) -> Floats:
    """Fit the confidence of a kind of joint, with or without a source."""
    sources = GAP_SOURCES if kind == "gap" else SOURCES
    own = [one for one in claims if one.kind == kind and one.source in sources and one.source != without]
    return (fit_gaps if kind == "gap" else fit_crossings)(own)


def report_confidence(claims: Sequence[Claim], lines: dict[str, Floats]) -> str:
    """Return the page on the confidence, in Markdown."""
    rows = []
    for kind in ("crossing", "gap", "cable"):
        of_kind = [one for one in claims if one.kind == kind]
        for source in {**SOURCES, **GAP_SOURCES}:
            own = [one for one in of_kind if one.source == source]
            if not own:
                continue
            stated = np.array([one.stated for one in own])
            if kind != "cable":
                stated = state(own, fit_line(claims, kind, source))
            right, sure = np.array([one.right for one in own]), stated > _SURE
            likely = (stated >= _LIKELY[0]) & (stated < _LIKELY[1])
            rows.append(
                f"| {kind} | {source} | {len(own)} | {stated.mean():.3f} | {right.mean():.3f} | "
                f"{calibration_error(stated, right):.3f} | {right[likely].sum()} of {likely.sum()} | "
                f"{(~right[sure]).sum()} of {sure.sum()} |"
            )
    said = " and ".join(
        " ".join([f"{line[0]:.2f}", *(f"{unit:+.2f} {name}" for unit, name in zip(line[1:], names, strict=True))])
        + f" for a {kind}"
        for (kind, line), names in zip(lines.items(), ("mc", "mst"), strict=True)
    )
    return _ON_CONFIDENCE.format(lines=said) + "\n".join(rows) + "\n"


_MOSTLY_FITTED = "fitted, `OTHER_COLOUR` counted, `GAP_SEEN` by definition"
"""Source of the weights of joints."""


def write_weights(found: Fit) -> str:
    """Return the module of the weights."""
    names = list(COLUMNS)
    count = names.index("OPEN_JUNCTION")
    parts = [
        _module("The weights of the columns of `joint_features`, nats a unit", "weights", "\nimport numpy as np\n")
    ]
    for name, what, how, own in (
        ("JOINT", "Cost of each column of a joint, nats a unit", _MOSTLY_FITTED, slice(0, count)),
        ("OPEN", "Cost of each column of an end that stays open, nats a unit", "fitted", slice(count, None)),
    ):
        figures = zip(names[own], found.weights[own], strict=True)
        rows = "".join(f"    {weight:.2f},  # {column}\n" for column, weight in figures)
        parts.append(f"{name} = np.array([\n{rows}])  # fmt: skip\n" + _docstring(what, "weights", how))
    return "\n".join(parts)


def write_lines(lines: dict[str, Floats]) -> str:
    """Return the module of the confidence."""
    parts = [_module("The confidence of joints", "confidence", "")]
    for kind, where, more in (
        ("crossing", "through a junction", "nat of cost"),
        ("gap", "across a gap", "unit of `seen` and of `taper`"),
    ):
        what = f"Log-odds that a joint {where} is right: all else aside, per nat of margin, per {more}"
        numbers = ", ".join(f"{number:.2f}" for number in lines[kind])
        parts.append(f"{kind.upper()} = ({numbers})\n" + _docstring(what, "confidence"))
    return "\n".join(parts)


def write_existence(line: Floats) -> str:
    """Return the module of the existence."""
    what = "Log-odds that an object is a cable: one as large as the largest, and per unit of the logarithm of its share"
    numbers = ", ".join(f"{number:.2f}" for number in line)
    return _module("The existence of objects", "existence", "") + (
        f"\nSIZE = ({numbers})\n" + _docstring(what, "existence")
    )


def _module(what: str, page: str, imports: str) -> str:
    return (
        f'"""{what}; made by ``python -m benchmarks.fit_linking {page}``.\n\n'
        f"docs/maintainers/linking-{page}.md has what they were fitted to, and the results on each source left out.\n"
        f'"""\n\nfrom __future__ import annotations\n{imports}'
    )


def _docstring(what: str, page: str, how: str = "fitted") -> str:
    return f'"""{what}.\n\nSource: {how}; see docs/maintainers/linking-{page}.md.\n"""\n'


if __name__ == "__main__":
    main()
