"""Props on the workbench: tools, paper and small parts, none of them of a cable's colour."""

from __future__ import annotations

import numpy as np

from dloftbs.support.arrays import FloatArray
from dloftbs_lab.synthetic.sketch import Sketch, Sprite, smooth_noise

STEEL = (168.0, 166.0, 160.0)
DARK_STEEL = (82.0, 80.0, 78.0)
YELLOW = (40.0, 178.0, 226.0)


def _round(across: FloatArray, colour: tuple[float, float, float], gloss: float = 0.25) -> FloatArray:
    """Shade a rod: `across` (h, w) runs from -1 on the lit side to 1."""
    q = np.clip(across, -1.0, 1.0)
    light = 0.45 + 0.65 * np.sqrt(1.0 - q * q) - 0.28 * q
    shine = gloss * 255.0 * np.exp(-(((q + 0.38) / 0.16) ** 2))
    return light[..., None] * np.asarray(colour) + shine[..., None]


def screwdriver(scale: float) -> Sprite:
    """Draw a screwdriver with a yellow handle."""
    s = Sketch(-150.0, -26.0, 150.0, 26.0, scale)
    s.fill(s.capsule((0.0, 0.0), (132.0, 0.0), 4.2), _round(s.y / 4.2, STEEL, 0.5))
    s.fill(s.box(124.0, -6.0, 144.0, 6.0, 1.5), _round(s.y / 8.0, STEEL, 0.3))
    flutes = 1.0 + 0.13 * np.cos(s.y * 1.1)
    waist = 15.0 - 3.5 * np.exp(-(((s.x + 35.0) / 16.0) ** 2))
    handle = np.maximum(s.box(-140.0, -20.0, -8.0, 20.0, 8.0), np.abs(s.y) - waist)
    s.fill(handle, _round(s.y / 17.0, YELLOW, 0.3) * flutes[..., None])
    s.fill(np.maximum(handle, np.abs(s.x + 122.0) - 6.0), _round(s.y / 17.0, (46.0, 44.0, 42.0), 0.2))
    s.fill(s.box(-12.0, -9.0, 2.0, 9.0, 3.0), _round(s.y / 9.0, (52.0, 50.0, 48.0), 0.2))
    return s.finish(9.0, 5.0)


def wrench(scale: float) -> Sprite:
    """Draw an open-ended spanner."""
    s = Sketch(-135.0, -34.0, 135.0, 34.0, scale)
    ring = np.maximum(s.disc((-100.0, 0.0), 27.0), -s.disc((-100.0, 0.0), 14.0))
    jaw = np.maximum(s.disc((100.0, 0.0), 29.0), -s.box(100.0, -13.0, 140.0, 13.0, 2.0))
    shaft = s.capsule((-82.0, 0.0), (82.0, 0.0), 10.0)
    whole = np.minimum(np.minimum(ring, jaw), shaft)
    brushed = 1.0 + 0.04 * np.sin(s.y * 5.0 + 0.5 * np.sin(s.x * 0.3))
    s.bevel(whole, np.asarray(STEEL) * brushed[..., None], 5.0, 0.45)
    s.bevel(np.maximum(s.box(-58.0, -4.5, 58.0, 4.5, 4.0), whole), np.multiply(STEEL, 0.86), 2.0, -0.25)
    return s.finish(6.0, 4.0)


def ruler(scale: float) -> Sprite:
    """Draw a steel rule."""
    s = Sketch(-212.0, -24.0, 212.0, 24.0, scale)
    sheen = 1.0 + 0.10 * np.cos(s.x / 70.0 + 1.0) + 0.02 * np.sin(s.y * 7.0)
    plate = np.maximum(s.box(-205.0, -17.0, 205.0, 17.0, 3.0), -s.disc((-192.0, 0.0), 5.0))
    s.bevel(plate, np.asarray((186.0, 186.0, 182.0)) * sheen[..., None], 1.5, 0.4)
    pitch = 5.0
    number = np.round(s.x / pitch)
    tall = np.where(number % 10 == 0, 15.0, np.where(number % 5 == 0, 11.0, 7.0))
    tick = np.maximum(np.abs(s.x - number * pitch) - 0.45, s.y + 17.0 - tall)
    s.fill(np.maximum(np.maximum(tick, np.abs(s.x) - 180.0), plate + 0.5), (58.0, 56.0, 54.0), 0.85)
    return s.finish(2.0, 1.6, 0.4)


def sheet(scale: float, rng: np.random.Generator) -> Sprite:
    """Draw a sheet of paper with lines of print and a small diagram."""
    s = Sketch(-120.0, -160.0, 120.0, 160.0, scale)
    wrinkle = 1.0 + 0.018 * smooth_noise(rng, s.x.shape, (60.0 * scale, 60.0 * scale))
    page = s.box(-112.0, -152.0, 112.0, 152.0, 1.5)
    s.fill(page, np.asarray((214.0, 222.0, 224.0)) * wrinkle[..., None])
    row = np.round((s.y + 118.0) / 11.0)
    end = rng.uniform(30.0, 88.0, 64)[np.clip(row, 0, 63).astype(int)]
    words = np.sin(s.x * 0.37 + 9.0 * row) + np.sin(s.x * 0.83 + 5.0 * row) > -0.9
    line = np.maximum(np.abs(s.y + 118.0 - 11.0 * row) - 1.5, np.maximum(-88.0 - s.x, s.x - end))
    ink = np.where(words & (row >= 0) & (row <= 15), line, 1.0)
    s.fill(ink, (105.0, 103.0, 102.0), 0.75)
    s.fill(s.box(-88.0, -140.0, 20.0, -131.0), (70.0, 68.0, 66.0), 0.8)
    s.fill(np.abs(s.box(-88.0, 66.0, 88.0, 136.0)) - 0.7, (96.0, 94.0, 92.0), 0.8)
    wave = np.abs(s.y - 101.0 - 22.0 * np.sin(s.x * 0.06) * np.exp(-((s.x / 70.0) ** 2))) - 1.1
    s.fill(np.maximum(wave, np.abs(s.x) - 80.0), (84.0, 82.0, 82.0), 0.8)
    return s.finish(2.5, 3.0, 0.35)


def tape(scale: float) -> Sprite:
    """Draw a roll of black tape."""
    s = Sketch(-56.0, -56.0, 56.0, 56.0, scale)
    radius = np.hypot(s.x, s.y)
    side = (s.x * -0.59 + s.y * -0.81) / np.maximum(radius, 1e-6)
    roll = np.maximum(radius - 50.0, 30.0 - radius)
    groove = 1.0 + 0.12 * np.sin(radius * 2.6)
    s.fill(roll, np.asarray((44.0, 43.0, 42.0)) * (groove * (1.1 + 0.5 * side))[..., None])
    core = np.maximum(radius - 31.0, 25.0 - radius)
    s.fill(core, np.asarray((120.0, 148.0, 164.0)) * (1.0 - 0.25 * side)[..., None])
    return s.finish(8.0, 5.0, 0.55)


def pencil(scale: float) -> Sprite:
    """Draw a sharpened pencil."""
    s = Sketch(-115.0, -10.0, 118.0, 10.0, scale)
    facet = np.where(s.y < -2.4, 1.12, np.where(s.y < 2.4, 1.0, 0.74))
    s.fill(s.box(-96.0, -6.0, 80.0, 6.0), np.asarray((52.0, 160.0, 214.0)) * facet[..., None])
    s.fill(s.box(-96.0, -6.2, -82.0, 6.2), _round(s.y / 6.2, STEEL, 0.3))
    s.fill(s.box(-110.0, -6.0, -96.0, 6.0, 3.0), _round(s.y / 6.0, (150.0, 152.0, 196.0), 0.1))
    tip = np.abs(s.y) - 6.0 * (112.0 - s.x) / 32.0
    s.fill(np.maximum(tip, np.maximum(80.0 - s.x, s.x - 112.0)), np.asarray((136.0, 186.0, 216.0)) * facet[..., None])
    s.fill(np.maximum(tip, 103.0 - s.x), (58.0, 56.0, 56.0))
    return s.finish(4.0, 2.5, 0.45)


def nut(scale: float) -> Sprite:
    """Draw a hexagonal nut."""
    s = Sketch(-18.0, -18.0, 18.0, 18.0, scale)
    turn = np.arange(6) * np.pi / 3.0
    hexagon = s.polygon([(14.0 * float(np.cos(a)), 14.0 * float(np.sin(a))) for a in turn])
    s.bevel(np.maximum(hexagon, -s.disc((0.0, 0.0), 7.0)), STEEL, 4.0, 0.6)
    return s.finish(4.0, 2.2, 0.55)


def washer(scale: float) -> Sprite:
    """Draw a flat washer."""
    s = Sketch(-18.0, -18.0, 18.0, 18.0, scale)
    s.bevel(np.maximum(s.disc((0.0, 0.0), 14.0), -s.disc((0.0, 0.0), 6.5)), (150.0, 148.0, 144.0), 2.0, 0.7)
    return s.finish(2.0, 1.5, 0.5)


def screw(scale: float) -> Sprite:
    """Draw a short machine screw."""
    s = Sketch(-24.0, -12.0, 26.0, 12.0, scale)
    thread = 1.0 + 0.22 * np.sin(s.x * 2.1 + s.y * 0.35)
    s.fill(s.box(-8.0, -4.0, 22.0, 4.0, 1.5), _round(s.y / 4.0, STEEL, 0.35) * thread[..., None])
    s.bevel(s.box(-19.0, -8.5, -8.0, 8.5, 3.0), DARK_STEEL, 3.0, 0.6)
    return s.finish(3.5, 2.0, 0.5)


def cutting_mat(scale: float, rng: np.random.Generator) -> Sprite:
    """Draw a grey-green cutting mat with its grid."""
    s = Sketch(-270.0, -190.0, 270.0, 190.0, scale)
    board = s.box(-262.0, -182.0, 262.0, 182.0, 9.0)
    worn = 1.0 + 0.05 * smooth_noise(rng, s.x.shape, (40.0 * scale, 40.0 * scale))
    worn += 0.03 * smooth_noise(rng, s.x.shape, (2.5 * scale, 2.5 * scale))
    s.bevel(board, np.asarray((92.0, 102.0, 74.0)) * worn[..., None], 2.0, 0.4)
    for pitch, weight, strength in ((22.0, 0.5, 0.35), (110.0, 0.8, 0.55)):
        grid = np.minimum(np.abs(s.x - pitch * np.round(s.x / pitch)), np.abs(s.y - pitch * np.round(s.y / pitch)))
        inner = s.box(-244.0, -166.0, 244.0, 166.0)
        s.fill(np.maximum(grid - weight, inner), (150.0, 166.0, 140.0), strength)
    s.fill(np.abs(s.box(-244.0, -166.0, 244.0, 166.0)) - 0.9, (160.0, 176.0, 150.0), 0.6)
    for _ in range(14):
        start = rng.uniform((-230.0, -150.0), (230.0, 150.0))
        end = start + rng.normal(size=2) * 60.0
        cut = s.capsule((float(start[0]), float(start[1])), (float(end[0]), float(end[1])), 0.45)
        s.fill(np.maximum(cut, board + 8.0), (70.0, 80.0, 56.0), 0.5)
    return s.finish(3.0, 3.0, 0.45)
