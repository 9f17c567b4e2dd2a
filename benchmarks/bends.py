"""Bend radius and slack of drawn cables: arcs that begin abruptly, waves, clean masks and noisy ones."""

from __future__ import annotations

import cv2
import numpy as np
import numpy.typing as npt

import dloftbs

_WIDTH_PX = 10
_SIZE = (420, 560)

_Floats = npt.NDArray[np.float64]
_Mask = npt.NDArray[np.bool_]


def arc(radius: float, angle: float) -> _Floats:
    """Return the points (n, 2) of an arc between straight parts, which begins and ends abruptly."""
    turns = np.concatenate((np.zeros(120), np.linspace(0.0, angle, max(int(radius * angle), 2)), np.full(120, angle)))
    steps = np.stack((np.cos(turns), np.sin(turns)), axis=1)
    return np.cumsum(steps, axis=0)


def wave(radius: float, length: float) -> _Floats:
    """Return the points (n, 2) of a sine of a wavelength whose tightest bend has a radius, px."""
    x = np.linspace(0.0, 2.0 * length, 2000)
    wave_number = 2.0 * np.pi / length
    return np.stack((x, np.sin(wave_number * x) / (radius * wave_number**2)), axis=1)


def drawn(points: _Floats, angle: float, noise: np.random.Generator | None) -> tuple[_Mask, _Floats]:
    """Return a mask of a cable, turned by an angle, and where it is; with `noise`, its edge waves by about a pixel."""
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    points = points @ turn.T
    points += 0.5 * np.array(_SIZE[::-1]) - 0.5 * (points.min(axis=0) + points.max(axis=0))
    canvas = np.zeros((8 * _SIZE[0], 8 * _SIZE[1]), np.uint8)
    line = np.rint(16.0 * (8.0 * points + 3.5)).astype(np.int32)
    cv2.polylines(canvas, [line], False, (255.0,), 8 * _WIDTH_PX, cv2.LINE_8, 4)
    share = cv2.resize(canvas, _SIZE[::-1], interpolation=cv2.INTER_AREA) / 255.0
    if noise is not None:
        waves = cv2.GaussianBlur(noise.normal(size=_SIZE), (0, 0), 1.5)
        share = cv2.GaussianBlur(share, (0, 0), 1.5) + 0.25 * waves / waves.std()
    return share > 0.5, points


def measure(kind: str, is_noisy: bool, count: int = 24) -> tuple[_Floats, _Floats]:
    """Return shares (n,) by which the tightest radii are off, and by which the slack is, of the length."""
    rng = np.random.default_rng(57)
    radii, slacks = [], []
    for _ in range(count):
        radius = _WIDTH_PX * rng.uniform(3.0, 10.0)
        points = arc(radius, rng.uniform(1.6, 3.1)) if kind == "arcs" else wave(radius, radius * rng.uniform(4.0, 7.0))
        if np.ptp(points, axis=0).max() > 0.9 * min(_SIZE):
            points = points[: int(0.8 * len(points))]
        mask, true = drawn(points, rng.uniform(0.0, 2.0 * np.pi), rng if is_noisy else None)
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
                f"{100.0 * np.quantile(np.abs(radii), 0.68):5.1f} % (68 of 100 within), "
                f"slack {100.0 * np.quantile(np.abs(slacks), 0.95):5.2f} % (95 of 100 within), {len(radii)} cables"
            )


if __name__ == "__main__":
    main()
