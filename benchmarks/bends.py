"""Bend radius and slack of drawn cables: arcs that begin abruptly, waves, clean masks and noisy ones."""

from __future__ import annotations

import cv2
import numpy as np
import numpy.typing as npt

import dloftbs

_WIDTHS_PX = (6, 16)
_MARGIN_PX = 40

_Floats = npt.NDArray[np.float64]
_Mask = npt.NDArray[np.bool_]


def arc(radius: float, angle: float, straight: float) -> _Floats:
    """Return the points (n, 2) of an arc between straight parts, px: it begins and ends abruptly."""
    sides = int(4.0 * straight)
    turns = np.concatenate((np.zeros(sides), np.linspace(0.0, angle, int(4.0 * radius * angle)), np.full(sides, angle)))
    steps = np.stack((np.cos(turns), np.sin(turns)), axis=1)
    return 0.25 * np.cumsum(steps, axis=0)


def wave(radius: float, length: float) -> _Floats:
    """Return the points (n, 2) of a sine of a wavelength whose tightest bend has a radius, px."""
    x = np.linspace(0.0, 2.0 * length, 2000)
    wave_number = 2.0 * np.pi / length
    return np.stack((x, np.sin(wave_number * x) / (radius * wave_number**2)), axis=1)


def drawn(points: _Floats, angle: float, width: int, noise: np.random.Generator | None) -> tuple[_Mask, _Floats]:
    """Return a mask of a cable, turned by an angle, and where it is; with `noise`, its edge waves by about a pixel."""
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    points = points @ turn.T
    points += _MARGIN_PX - points.min(axis=0)
    columns, rows = np.ceil(points.max(axis=0) + _MARGIN_PX).astype(int).tolist()
    canvas = np.zeros((8 * rows, 8 * columns), np.uint8)
    line = np.rint(16.0 * (8.0 * points + 3.5)).astype(np.int32)
    cv2.polylines(canvas, [line], False, (255.0,), 8 * width, cv2.LINE_8, 4)
    share = cv2.resize(canvas, (columns, rows), interpolation=cv2.INTER_AREA) / 255.0
    if noise is not None:
        waves = cv2.GaussianBlur(noise.normal(size=share.shape), (0, 0), 1.5)
        share = cv2.GaussianBlur(share, (0, 0), 1.5)
        share += 0.25 * waves / waves.std() * 4.0 * share * (1.0 - share)  # at the edge alone: specks are other objects
    return share > 0.5, points


def measure(kind: str, is_noisy: bool, count: int = 48, seed: int = 57) -> tuple[_Floats, _Floats]:
    """Return shares (n,) by which the tightest radii are off, and by which the slack is, of the length."""
    rng = np.random.default_rng(seed)
    radii, slacks = [], []
    for _ in range(count):
        width = int(rng.integers(*_WIDTHS_PX))
        radius = width * rng.uniform(3.0, 10.0)
        if kind == "arcs":
            points = arc(radius, rng.uniform(1.6, 3.1), width * rng.uniform(1.0, 12.0))
        else:
            points = wave(radius, radius * rng.uniform(4.0, 7.0))
        mask, true = drawn(points, rng.uniform(0.0, 2.0 * np.pi), width, rng if is_noisy else None)
        found = dloftbs.detect(mask)
        if len(found) != 1:
            continue
        radii.append(found[0].tightest_bend()[1] / radius - 1.0)
        a, b = (found[0].curve.nearest(one)[0] for one in (true[len(true) // 5], true[-len(true) // 5]))
        part = true[len(true) // 5 : len(true) - len(true) // 5]
        length = float(np.linalg.norm(np.diff(part, axis=0), axis=1).sum())
        slack = length - float(np.linalg.norm(part[-1] - part[0]))
        slacks.append((found[0].curve.slack(min(a, b), max(a, b)) - slack) / length)
    return np.array(radii), np.array(slacks)


def main() -> None:
    """Print the table."""
    for kind in ("arcs", "waves"):
        for is_noisy in (False, True):
            radii, slacks = measure(kind, is_noisy)
            scene = f"{kind}, {'noisy' if is_noisy else 'clean'}"
            print(
                f"{scene:<16}radius {100.0 * np.median(radii):+6.1f} % (median), "
                f"{100.0 * np.median(np.abs(radii)):5.1f} % (half within), "
                f"{100.0 * np.quantile(np.abs(radii), 0.68):5.1f} % (68 of 100 within), "
                f"slack {100.0 * np.quantile(np.abs(slacks), 0.95):5.2f} % (95 of 100 within), {len(radii)} cables"
            )


if __name__ == "__main__":
    main()
