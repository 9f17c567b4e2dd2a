"""How much the shape of an end says about whether something hides the rest: what the prices of open ends come from.

Run with ``python -m benchmarks.end_shapes``. Cables of 4 to 16 px end flat, round, frayed and tapered, each as often;
discs and slanting bars cut them in two. A logistic regression of *cut* on the measured roundness, both classes with the
same weight, gives by how many nats roundness changes the odds.
"""

from __future__ import annotations

from collections.abc import Iterator

import cv2
import numpy as np
from scipy.optimize import minimize

from dloftbs import Config
from dloftbs.cleaning import clean
from dloftbs.linking.centerlines import _GAP_SCALE
from dloftbs.linking.kernels.bending import OPEN_CUT, OPEN_ROUND
from dloftbs.skeleton import build_graph, skeletonize
from dloftbs.synthetic.free_ends import FreeEnd, draw_cable_mask
from dloftbs.synthetic.strand import integrate

_CABLES, _SEED = 600, 0
_LENGTH_PX, _MARGIN_PX = 260.0, 40.0
_WIDTHS_PX, _DISC_RADIUS_PX, _BAR_PX = (4.0, 16.0), (18.0, 34.0), (20.0, 60.0)
_SLANT_RAD = 0.7
_NEAR_WIDTHS = 2.5  # from the tip of a cable to its free end in the mask, at most
_MOST_RUNS = 1000


def ends(count: int, seed: int) -> Iterator[tuple[str, float]]:
    """Yield what each end of drawn cables is (a style, disc or bar), and its measured roundness."""
    rng = np.random.default_rng(seed)
    for number in range(count):
        width = float(rng.uniform(*_WIDTHS_PX))
        bending = rng.uniform(-0.8, 0.8) * np.linspace(0.0, 1.0, round(2.0 * _LENGTH_PX))
        line = integrate(rng.uniform(0.0, 2.0 * np.pi) + bending, _LENGTH_PX).points
        line = line - line.min(axis=0) + _MARGIN_PX
        size = (int(line[:, 1].max() + _MARGIN_PX), int(line[:, 0].max() + _MARGIN_PX))
        styles = FreeEnd.draw(rng), FreeEnd.draw(rng)
        cover, what = np.zeros(size, np.uint8), "disc" if number % 2 else "bar"
        middle, ahead = line[len(line) // 2], line[len(line) // 2 + 20] - line[len(line) // 2]
        if what == "disc":
            cv2.circle(cover, np.rint(middle).astype(int).tolist(), int(rng.uniform(*_DISC_RADIUS_PX)), 1, -1)
        else:
            angle = np.arctan2(ahead[1], ahead[0]) + np.pi / 2.0 + rng.uniform(-_SLANT_RAD, _SLANT_RAD)
            way = 2.0 * _LENGTH_PX * np.array([np.cos(angle), np.sin(angle)])
            first, last = (np.rint(middle + sign * way).astype(int).tolist() for sign in (-1.0, 1.0))
            cv2.line(cover, first, last, 1, int(rng.uniform(*_BAR_PX)))
        mask = draw_cable_mask(line, np.full(len(line), width), size, styles) & (cover == 0)
        patch = clean(mask, Config().cleaning)
        if patch is None:
            continue
        graph, _ = build_graph(patch, skeletonize(patch), _MOST_RUNS)
        assert graph is not None  # a cable has few runs
        for end in np.flatnonzero((graph.nodes == -1) & ~np.repeat(graph.spurs, 2)):
            place = patch.to_image(graph.end_states[end : end + 1, :2])[0]
            off = np.linalg.norm(line[[0, -1]] - place, axis=1)
            tip = int(off.argmin())
            yield styles[tip].style if off[tip] < _NEAR_WIDTHS * width else what, float(graph.end_roundness[end])


def main() -> None:
    """Print the roundness of each kind of end, the nats, and the difference of prices that follows."""
    kinds, caps = (np.array(column) for column in zip(*ends(_CABLES, _SEED), strict=True))
    for kind in sorted(set(kinds.tolist())):
        own = caps[kinds == kind]
        print(f"{kind:8} {len(own):4} ends, roundness {own.mean():.2f} +- {own.std():.2f}")
    is_cut = np.isin(kinds, ("disc", "bar"))
    weight = np.where(is_cut, 1.0 / is_cut.sum(), 1.0 / (~is_cut).sum())
    sign = np.where(is_cut, 1.0, -1.0)

    def loss(given: tuple[float, float]) -> float:
        return float((weight * np.logaddexp(0.0, -sign * (given[0] + given[1] * caps))).sum())

    _, slope = minimize(loss, (0.0, 0.0)).x
    print(f"roundness changes the odds by {-slope:.2f} nats: {-slope * _GAP_SCALE:.2f} between the prices")
    print(f"in use: {OPEN_CUT - OPEN_ROUND:.2f}")


if __name__ == "__main__":
    main()
