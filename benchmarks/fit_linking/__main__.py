"""Fit the weights of linking, or the confidence of its joints, to labelled scenes.

Run it in the repository with ``python -m benchmarks.fit_linking weights FOLDER``, and then with ``confidence``. The
folder holds ``cables/NNNNN.txt`` with points along each cable, ``NNNNN.jpg`` and ``NNNNN_mask_all.png``, as the data
set of Ariadne has them; ``mbest/*/NN.labels.png`` with ``NN.jpg``, whose pixel value is the cable's number, as that of
mBEST; and ``masks/NNN.png`` with ``masks/original_curves.json``, masks of one cable each and points along it. Either
prints a page of the documents; ``--write`` writes it, and the fitted numbers. Without the simulator or one of these
nothing is fitted.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

import numpy as np

from benchmarks.fit_linking.confidence import Claim, calibration_error, fit_crossings, fit_gaps, list_claims, state
from benchmarks.fit_linking.model import Fit, count_wrong, fit, mean_loss
from benchmarks.fit_linking.readings import Choice, Floats, list_choices
from benchmarks.fit_linking.scenes import FIXED, GAP_SOURCES, SOURCES, list_scenes
from dloftbs.linking import calibration
from dloftbs.linking.kernels import weights as in_use
from dloftbs.linking.kernels.joint_features import GAP_ROUND

DOCS = Path(__file__).parents[2] / "docs"

COLUMNS = {
    "LINK_TURN": "turn through a junction, as a bend, rad²",
    "LINK_SWERVE": "swerve through a junction, as a bend, rad²",
    "GAP_ENERGY": "bend across a gap over its length, rad² a width",
    "GAP_LENGTH": "length of a gap, widths",
    "GAP_ROUND": "roundness of both ends of a gap that is no break of the mask",
    "GAP_GROUND": "ground in sight across a gap, widths",
    "GAP_HIDDEN": "shown to be hidden across a gap, widths",
    "DEPTH_SWERVE": "swerve towards the camera or away from it, as a bend, rad²",
    "OTHER_COLOUR": "cables before both ends that differ clearly in colour",
    "OPEN_JUNCTION": "an end left open at a junction",
    "OPEN_KINK": "an end left open at a sharp turn",
    "OPEN_FREE": "a free end left open",
}
"""What each column is, in their order; those of joints come first."""

_SEEDS = {"weights": (1, 2), "confidence": (101, 102)}
_SURE, _LIKELY = 0.99, (0.9, 0.95)

_ON_WEIGHTS = """# The weights of linking

For maintainers; [how linking decides](linking.md) says what they mean. Made by `python -m benchmarks.fit_linking
weights`.

A choice is a set of branch ends that may be joined with each other, with all its readings. The odds of a reading are e
to the power of minus its cost, and the weights are those under which the true readings are the most probable. Sources
count alike, as far as they have enough. Hidden cables count three times and the few real masks that are broken four
times: that is the balance, by hand, between gaps behind which one cable goes on and ends of two cables that face each
other, which a mask alone does not tell apart.
"""
_ON_CONFIDENCE = """# The confidence of joints

For maintainers; [how linking decides](linking.md) says what it means. Made by `python -m benchmarks.fit_linking
confidence`, of other scenes than the [weights](linking-weights.md).

The confidence of a joint is the probability that it is right. Its log-odds go with its margin m and its cost c, nats;
those of a gap with its margin and with what it joins: s is the logarithm of the length of the longer side in widths,
and t that of the ratio of the widths of both sides:
{lines}.
Those of a gap are at most the margin. That of a cable is the product of its joints' and its ends'; a right cable lies
on one true curve. Each crossing counts alike. Gaps are fitted to sources with debris, dashes and stubs alone, which
count alike, but networks' masks three times, by hand: they have most of the objects. A gap below
`linking.min_gap_confidence` stays open; here all count. The table has the mean of what is stated, of joints with the
source left out of the fit, the share that is right, the mean distance between the two, over bins, and how many of
those stated between .9 and .95 are right. Left out, the networks are off the most: no other source has stubs that are
thinner than the cable they belong to.

With a mask alone, a gap between two ends that face each other looks the same whether something hides the cable or two
cables end there. Of the drawn ones none is right, of those behind discs nearly all are: no number serves both.

| what | source | number | stated | right | error | right of .9 to .95 | wrong above .99 |
| --- | --- | ---: | ---: | ---: | ---: | ---: | ---: |
"""


def main() -> None:
    """Collect the scenes, fit, and print or write the page and the numbers."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("what", choices=tuple(_SEEDS))
    parser.add_argument("photographs", type=Path)
    parser.add_argument("--write", action="store_true", help="write the numbers and the page")
    parser.add_argument("--amount", type=float, default=1.0, help="share of the scenes, to see that it runs")
    given = parser.parse_args()
    seeds = _SEEDS[given.what]
    options = given.amount, given.photographs
    sources = SOURCES if given.what == "weights" else list({**SOURCES, **GAP_SOURCES})
    tasks = [
        (source, seed, *options) for source in sources for seed in seeds if source not in FIXED or seed == seeds[0]
    ]
    with ProcessPoolExecutor() as pool:
        if given.what == "weights":
            choices = [choice for part in pool.map(_choices, *zip(*tasks, strict=True)) for choice in part]
            found = fit(choices)
            page, code, target = report_weights(choices, found), write_weights(found), Path(in_use.__file__)
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


def report_weights(choices: Sequence[Choice], found: Fit) -> str:
    """Return the page on the weights, in Markdown."""
    by_source = {name: [choice for choice in choices if choice.source == name] for name in SOURCES}
    lines = [_ON_WEIGHTS, "| source | what | choices |", "| --- | --- | ---: |"]
    lines += [f"| {name} | {what} | {len(by_source[name])} |" for name, what in SOURCES.items()]
    lines += ["", "| column | nats a unit | deviation |", "| --- | ---: | ---: |"]
    lines += [
        f"| `{name}`: {what} | {weight:.2f} | {deviation:.2f} |"
        for (name, what), weight, deviation in zip(COLUMNS.items(), found.weights, found.deviations, strict=True)
    ]
    lines += [
        "",
        "How many choices are read wrongly, and in brackets the mean of minus the logarithm of the true reading's",
        "probability: with all sources, with the source left out of the fit, and without the shape of ends.",
        "",
        "| source | all | left out | without end shape |",
        "| --- | ---: | ---: | ---: |",
    ]
    blind = fit(_without(choices, GAP_ROUND))
    for name, own in by_source.items():
        others = fit([choice for choice in choices if choice.source != name])
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


_MOSTLY_FITTED = "fitted, but `OTHER_COLOUR` is counted (docs/linking.md)"
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


def _module(what: str, page: str, imports: str) -> str:
    return (
        f'"""{what}; made by ``python -m benchmarks.fit_linking {page}``.\n\n'
        f"docs/linking-{page}.md has what they were fitted to, and the results on each source left out.\n"
        f'"""\n\nfrom __future__ import annotations\n{imports}'
    )


def _docstring(what: str, page: str, how: str = "fitted") -> str:
    return f'"""{what}.\n\nSource: {how}; see docs/linking-{page}.md.\n"""\n'


if __name__ == "__main__":
    main()
