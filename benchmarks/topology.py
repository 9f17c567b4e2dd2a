"""Topology against an oracle, and of ropes that are drawn: what `docs/topology.md` states.

Run it in the repository with ``python -m benchmarks.topology``; it needs ``spherogram`` (the extra `dev`).
"""

from __future__ import annotations

import random
import time
from collections import Counter
from collections.abc import Sequence
from itertools import chain, combinations
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from benchmarks.docs import arguments, published
from benchmarks.knot_drawings import KNOTS, Drawing, draw_knot, draw_random
from dloftbs import InputError, Pipeline, viz
from dloftbs.topology import Diagram
from dloftbs.topology.knot_type import determinant

SEED = 57
PICTURE = Path(__file__).parents[1] / "docs" / "images" / "topology.png"


def projection(rng: np.random.Generator, strands: int, closed: bool) -> Diagram:
    """Return a random projection of straight sides in space, of 3 to 40 crossings."""
    while True:
        corners = [rng.normal(size=(int(rng.integers(5, 23 // strands)), 3)) for _ in range(strands)]
        diagram = Diagram.from_curves(corners, closed=closed)
        if 3 <= len(diagram.turns) <= 40:
            return diagram


def agreement(drawn: Diagram) -> dict[str, bool]:
    """Say in what a closed diagram agrees with spherogram."""
    from spherogram import Link

    link = Link([list(crossing) for crossing in drawn.pd_code or ()])
    is_apart = () in (drawn.gauss_code or ())  # a strand without crossings, which such a code does not hold
    simplified, found = drawn.simplify().diagram, {}
    matrix = None if is_apart else _seifert_matrix(link)
    found["codes equal"] = link.writhe() == drawn.writhe and _same_code(link, drawn)
    found["linking numbers equal"] = (
        _linking(link) == Counter(abs(number or 0) for number in drawn.linking_numbers.values() if number)
        and drawn.linking_numbers == simplified.linking_numbers
    )
    polynomial = drawn.alexander_polynomial or ()
    found["Alexander polynomial equal"] = _same_polynomial(matrix, polynomial)
    found["determinant equal"] = _value(matrix, -1) == drawn.determinant == simplified.determinant
    link.simplify("level")
    found["no more crossings after simplification"] = len(simplified.turns) <= len(link.crossings)
    return found


def _same_code(link: Any, drawn: Diagram) -> bool:
    """Say whether spherogram's own code of what it read is ours up to the numbers of edges.

    A code leaves open which way a strand runs that never lies below: either way of these will do.
    """
    back = Diagram.from_pd_code(link.PD_code())
    free = [number for number, strand in enumerate(back.gauss_code or ()) if min(strand, default=0) > 0]
    ways = chain.from_iterable(combinations(free, count) for count in range(len(free) + 1))
    return any(_shape(_turned(back, strands)) == _shape(drawn) for strands in ways)


def _turned(drawn: Diagram, strands: Sequence[int]) -> Diagram:
    """Return a closed diagram with some strands, which lie over all others, run backwards."""
    code = [strand[::-1] if number in strands else strand for number, strand in enumerate(drawn.gauss_code or ())]
    crossed = {number for strand in strands for number in code[strand]}
    signs = [-sign if number in crossed else sign for number, sign in enumerate(drawn.signs or (), 1)]
    return Diagram.from_gauss_code(code, signs)


def _shape(drawn: Diagram) -> Any:
    """Return what does not depend on where the numbers of crossings and strands begin: all signed walks, rotated."""
    signs = drawn.signs or ()
    code = drawn.gauss_code or ()
    best = []
    for strand in filter(None, code):
        turns = [strand[k:] + strand[:k] for k in range(len(strand))]
        walks = []
        for turn in turns:
            first: dict[int, int] = {}
            walks.append([(first.setdefault(abs(n), len(first)), n > 0, signs[abs(n) - 1]) for n in turn])
        best.append(min(walks))
    return sorted(best)


def _linking(link: Any) -> Counter[int]:
    owners: dict[Any, list[int]] = {}
    for strand, component in enumerate(link.link_components):
        for entry in component:
            owners.setdefault(entry.crossing, []).append(strand)
    sums = dict.fromkeys(combinations(range(len(link.link_components)), 2), 0)
    for crossing, both in owners.items():
        if both[0] != both[1]:
            sums[min(both), max(both)] += crossing.sign
    return Counter(abs(total) // 2 for total in sums.values() if total)


def _seifert_matrix(link: Any) -> npt.NDArray[np.object_] | None:
    """Return spherogram's Seifert matrix (n, n); None of what can be pulled apart, and has no connected surface."""
    from spherogram.links.seifert import seifert_matrix

    if len(link.split_link_diagram()) > 1:
        return None
    matrix = np.array(seifert_matrix(link.copy()), dtype=object)
    return matrix.reshape(len(matrix), len(matrix))


def _value(matrix: npt.NDArray[np.object_] | None, t: int) -> int:
    """Return the absolute value of the Alexander polynomial of a Seifert matrix at a whole number."""
    return 0 if matrix is None else abs(determinant((matrix - t * matrix.T).tolist()))


def _same_polynomial(matrix: npt.NDArray[np.object_] | None, ours: tuple[int, ...]) -> bool:
    """Compare at 2 and 3, up to powers of these."""
    for t in (2, 3):
        theirs, value = _value(matrix, t), abs(sum(one * t**power for power, one in enumerate(ours)))
        for number in (theirs, value):
            if (number == 0) != (theirs == 0):
                return False
        while value and theirs % t == 0:
            theirs //= t
        while value and value % t == 0:
            value //= t
        if theirs != value:
            return False
    return True


def against_spherogram(count: int) -> None:
    """Print in how many random projections we agree with spherogram."""
    print(f"{count} random projections of 3 to 40 crossings: one closed strand, one open, two or three; a third each\n")
    rng, agreed, asked, spent = np.random.default_rng(SEED), Counter[str](), Counter[str](), 0.0
    random.seed(SEED)
    for k in range(count):
        strands = 2 + k // 3 % 2 if k % 3 == 2 else 1
        diagram = projection(rng, strands, closed=k % 3 != 1)
        drawn = diagram.close(over=k % 2 == 0)
        start = time.perf_counter()
        drawn.simplify()
        spent += time.perf_counter() - start
        for name, same in agreement(drawn).items():
            asked[name] += 1
            agreed[name] += same
    for name, number in asked.items():
        print(f"{name:<40}{agreed[name]} of {number}")
    print(f"{'a simplification takes':<40}{1e3 * spent / count:.2f} ms\n")


def drawn_ropes(title: str, drawings: list[tuple[str, Drawing]], is_right: Any) -> None:
    """Print how many drawings are told right, wrong, or not at all, from the mask and its picture."""
    told: dict[str, Counter[str]] = {}
    probable: dict[str, list[float]] = {}
    pipeline = Pipeline()
    for kind, drawing in drawings:
        result = pipeline.detect(drawing.frame)
        try:
            diagram = Diagram.from_result(result)
            answer = is_right(diagram, drawing.truth) if len(result) == 1 else None
            probable.setdefault("none" if answer is None else "right" if answer else "wrong", []).append(
                diagram.probability
            )
        except InputError:
            answer = None
        told.setdefault(kind, Counter())["none" if answer is None else "right" if answer else "wrong"] += 1
    print(f"{title:<40}{'drawn':>8}{'right':>8}{'wrong':>8}{'None':>8}")
    for kind, one in [*told.items(), ("all", sum(told.values(), Counter()))]:
        print(f"{kind:<40}{one.total():>8}{one['right']:>8}{one['wrong']:>8}{one['none']:>8}")
    means = ", ".join(f"{kind} {np.mean(values):.2f}" for kind, values in sorted(probable.items()))
    print(f"mean probability that the code is right: {means}\n")


def _is_named(ours: Diagram, truth: Diagram) -> bool | None:
    return None if ours.name is None else ours.name == truth.name


def _is_told(ours: Diagram, truth: Diagram) -> bool | None:
    return None if ours.is_knotted is None else ours.is_knotted is truth.is_knotted


def named(count: int) -> list[tuple[str, Drawing]]:
    """Draw the knots of the table, as they are and mirrored, closed and cut open."""
    from spherogram import Link

    rng = np.random.default_rng(SEED)
    made: list[tuple[str, Drawing]] = []
    for k in range(count):
        link = Link(KNOTS[k % len(KNOTS)])
        is_open = bool(rng.random() < 0.5)
        link = link.mirror() if rng.random() < 0.5 else link
        made.append(("open ropes" if is_open else "closed ropes", draw_knot(link, rng, is_open)))
    return made


def tangled(count: int, step_widths: float) -> list[tuple[str, Drawing]]:
    """Draw random open ropes of 3 to 8 crossings, half of these knotted."""
    rng = np.random.default_rng(SEED + 1)
    kinds = "knotted", "trivially tangled"
    return [(kinds[k % 2], draw_random(rng, step_widths, knotted=k % 2 == 0)) for k in range(count)]


def picture(drawings: list[tuple[str, Drawing]]) -> npt.NDArray[np.uint8]:
    """Draw some of the ropes beside each other, with what is said of them."""
    tiles: list[npt.NDArray[np.uint8]] = []
    titles: list[str] = []
    for _, drawing in drawings:
        result = Pipeline().detect(drawing.frame)
        diagram = Diagram.from_result(result)
        tiles.append(viz.draw(drawing.frame, result))
        titles.append(diagram.name or "unknown" if diagram.is_knotted else "not knotted")
    return viz.contact_sheet(tiles, titles=titles, columns=len(tiles), tile_width=300)


def main() -> None:
    parser = arguments(__doc__, "a twentieth of the projections and drawings")
    options = parser.parse_args()
    share = 20 if options.quick else 1
    with published("topology", options.docs):
        against_spherogram(5000 // share)
        drawn_ropes("knots of up to 7 crossings, named", named(112 // share), _is_named)
        for step_widths in (4.0, 3.2, 2.8):
            drawn_ropes(
                f"random ropes, strands {step_widths:g} widths apart", tangled(120 // share, step_widths), _is_told
            )
    if options.docs:
        some = [*[one for one in named(60) if one[0] == "open ropes"][3:6], *tangled(2, 4.0)[1:]]
        PICTURE.write_bytes(viz.as_png(picture(some)))


if __name__ == "__main__":
    main()
