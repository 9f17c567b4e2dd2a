"""Cables simulated by MuJoCo: what they do while their ends are led, as nodes in space."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from importlib.util import find_spec
from typing import Any

import numpy as np

from dloftbs.errors import DloftbsError, InputError
from dloftbs.support.arrays import FloatArray
from dloftbs_lab.synthetic.motion import smoothstep, window

REMEDY = "simulated cables need MuJoCo: pip install 'dloftbs[evaluation]'"

_LENGTH_M = 0.6
_NODES = 41
RADIUS_M = 0.004
_HEIGHT_M = 0.6  # at the start, where there is no floor
_STEP_S = 0.001
_FPS = 30.0
_RESTLESS = 0.02  # velocities at the start, rad/s: nothing buckles out of perfect symmetry

Pose = tuple[FloatArray, FloatArray]
"""Of a grip: how far it has moved, (3,) m, and turned, as a rotation vector (3,) rad."""
Led = Callable[[float], Pose]
"""Phase in 0..1 to the pose of a grip."""


@dataclass(frozen=True)
class Experiment:
    """Experiment with a cable that is straight along x at the start.

    Parameters
    ----------
    young_pa : float
        Modulus of its material: how stiff it is.
    first, last : Led or None
        Targets to which the grips lead its two ends; None where an end is free.
    gravity : bool
    floor : bool
    settle_s : float
        Before the first frame; grips go to where they are at phase 0.
    released : float
        Phase at which the last end is let go.
    elevation : (float, float)
        Angles above the horizon from which the camera may look, radians.
    """

    young_pa: float
    first: Led | None
    last: Led | None
    gravity: bool = False
    floor: bool = False
    settle_s: float = 0.0
    released: float = math.inf
    elevation: tuple[float, float] = (0.3, 1.4)


def available() -> bool:
    """Return whether MuJoCo is installed."""
    return find_spec("mujoco") is not None


def simulate(experiment: Experiment, rng: np.random.Generator, frames: int) -> FloatArray:
    """Return the nodes of a cable in each frame, 30 a second, shape (frames, 41, 3) m, z upwards.

    Raises
    ------
    InputError
        If MuJoCo is not installed.
    DloftbsError
        If the simulation becomes unstable.
    """
    if not available():
        raise InputError(REMEDY)
    import mujoco

    model = mujoco.MjModel.from_xml_string(_model(experiment))
    data = mujoco.MjData(model)
    data.qvel[:] = rng.normal(0.0, _RESTLESS, model.nv)
    starts = data.mocap_pos.copy()
    bodies = slice(model.body("B_first").id, model.body("B_last").id + 1)
    settling, per_frame = round(experiment.settle_s / _STEP_S), 1.0 / (_FPS * _STEP_S)
    nodes = []
    done = -settling
    for index in range(frames):
        while done < round(index * per_frame):
            phase = done / (frames * per_frame)
            _lead(experiment, data, starts, phase, 1.0 if phase >= 0.0 else (done + settling) / settling)
            mujoco.mj_step(model, data)
            done += 1
        mujoco.mj_kinematics(model, data)
        end = data.xpos[bodies][-1] + data.xmat[bodies][-1].reshape(3, 3)[:, 0] * (_LENGTH_M / (_NODES - 1))
        nodes.append(np.concatenate((data.xpos[bodies], end[None])))
    moved = np.array(nodes)
    if any(warning.number for warning in data.warning) or not np.isfinite(moved).all():
        raise DloftbsError("the simulation became unstable; take another seed")
    return moved


def _lead(experiment: Experiment, data: Any, starts: FloatArray, phase: float, share: float) -> None:
    """Put the grips where they are at a phase, before phase 0 a share of the way there."""
    leds = [led for led in (experiment.first, experiment.last) if led is not None]
    for number, led in enumerate(leds):
        way, turn = led(max(phase, 0.0))
        part = float(smoothstep(np.array(share)))
        data.mocap_pos[number] = starts[number] + part * way
        data.mocap_quat[number] = _quaternion(part * turn)
    if experiment.last is not None:
        data.eq_active[len(leds) - 1] = phase < experiment.released


def _quaternion(turn: FloatArray) -> FloatArray:
    angle = float(np.linalg.norm(turn))
    axis = turn / angle if angle > 0.0 else turn
    return np.array([math.cos(angle / 2.0), *(math.sin(angle / 2.0) * axis)])


def _model(experiment: Experiment) -> str:
    spacing = _LENGTH_M / (_NODES - 1)
    grips = [
        (name, x)
        for name, x, led in (
            ("B_first", -_LENGTH_M / 2.0, experiment.first),
            ("B_last", _LENGTH_M / 2.0 - spacing, experiment.last),
        )
        if led is not None
    ]
    floor, height = ('<geom type="plane" size="2 2 0.1"/>', RADIUS_M) if experiment.floor else ("", _HEIGHT_M)
    mocaps = "".join(f'<body name="grip {name}" mocap="true" pos="{x} 0 {height}"/>' for name, x in grips)
    welds = "".join(f'<weld body1="grip {name}" body2="{name}" solref="0.01 1"/>' for name, _ in grips)
    return f"""
<mujoco>
  <option timestep="{_STEP_S}" integrator="implicitfast" gravity="0 0 {-9.81 if experiment.gravity else 0.0}"/>
  <extension><plugin plugin="mujoco.elasticity.cable"/></extension>
  <worldbody>
    {floor}{mocaps}
    <composite type="cable" curve="s" count="{_NODES} 1 1" size="{_LENGTH_M}"
               offset="{-_LENGTH_M / 2.0} 0 {height}" initial="free">
      <plugin plugin="mujoco.elasticity.cable">
        <config key="twist" value="{experiment.young_pa}"/><config key="bend" value="{experiment.young_pa}"/>
      </plugin>
      <joint kind="main" damping="0.0003" armature="1e-6"/>
      <geom type="capsule" size="{RADIUS_M}" density="1000" friction="0.5"/>
    </composite>
  </worldbody>
  <equality>{welds}</equality>
</mujoco>"""


def hangs(rng: np.random.Generator) -> Experiment:
    """Return a soft cable that hangs from both ends, or from one, which are led about."""
    near, sway = rng.uniform(0.3, 0.6) * _LENGTH_M, rng.uniform(0.03, 0.12, (2, 3)) * (1.0, 1.0, 0.5)
    beat, start = rng.uniform(0.6, 1.2, 2), rng.uniform(0.0, 2.0 * math.pi, 2)

    def led(number: int) -> Led:
        def pose(phase: float) -> Pose:
            swing = math.sin(2.0 * math.pi * beat[number] * phase + start[number])
            return sway[number] * swing - np.array([number * near, 0.0, 0.0]), np.zeros(3)

        return pose

    last = led(1) if rng.random() < 0.7 else None
    return Experiment(float(rng.uniform(2e5, 1.5e6)), led(0), last, gravity=True, settle_s=0.8)


def bends(rng: np.random.Generator) -> Experiment:
    """Return a stiff cable that is bent by turning its ends against each other and bringing them together."""
    turns, near = rng.uniform(0.5, 1.6, 2), rng.uniform(0.2, 0.5) * _LENGTH_M
    tilt = rng.uniform(-0.6, 0.6)

    def led(sign: float, most: float) -> Led:
        def pose(phase: float) -> Pose:
            bent = window(phase, (0.0, 0.6), (0.7, 1.3))
            axis = np.array([0.0, math.cos(tilt), math.sin(tilt)])
            return np.array([-sign * near / 2.0 * bent, 0.0, 0.0]), sign * most * bent * axis

        return pose

    return Experiment(float(rng.uniform(3e6, 1e7)), led(-1.0, float(turns[0])), led(1.0, float(turns[1])))


def twists(rng: np.random.Generator) -> Experiment:
    """Return a cable that is twisted, with its ends a little together, until it coils up."""
    near, turns = rng.uniform(0.15, 0.4) * _LENGTH_M, rng.choice((-1.0, 1.0)) * rng.uniform(1.5, 4.0)

    def last(phase: float) -> Pose:
        together = float(smoothstep(np.array(phase / 0.4)))
        return np.array([-near * together, 0.0, 0.0]), np.array([2.0 * math.pi * turns * phase, 0.0, 0.0])

    return Experiment(float(rng.uniform(1e6, 4e6)), _still, last)


def buckles(rng: np.random.Generator) -> Experiment:
    """Return a cable whose ends are pushed together until it gives way to a side."""
    near, aside = rng.uniform(0.5, 0.85) * _LENGTH_M, rng.uniform(-0.06, 0.06, 2)

    def last(phase: float) -> Pose:
        return phase * np.array([-near, *aside]), np.zeros(3)

    return Experiment(float(rng.uniform(1e6, 8e6)), _still, last)


def snaps_back(rng: np.random.Generator) -> Experiment:
    """Return a cable that is bent to a hairpin and let go at one end."""
    near, aside = rng.uniform(0.7, 0.95) * _LENGTH_M, rng.uniform(0.04, 0.1) * rng.choice((-1.0, 1.0))
    turn = rng.uniform(2.0, math.pi) * np.array([0.0, 0.0, -1.0 if aside > 0.0 else 1.0])

    def last(phase: float) -> Pose:
        return np.array([-near, aside, 0.0]), -turn

    young, released = float(rng.uniform(1e6, 4e6)), float(rng.uniform(0.15, 0.4))
    return Experiment(young, _still, last, gravity=bool(rng.random() < 0.5), settle_s=1.0, released=released)


def tangles(rng: np.random.Generator) -> Experiment:
    """Return a very soft cable that lies on the floor, and whose ends are led over it in circles."""
    around, turns = rng.uniform(0.12, 0.2, 2) * _LENGTH_M, rng.uniform(0.8, 1.5, 2) * rng.choice((-1.0, 1.0), 2)
    near = rng.uniform(0.3, 0.5) * _LENGTH_M

    def led(number: int) -> Led:
        sign = 1.0 - 2.0 * number

        def pose(phase: float) -> Pose:
            angle = 2.0 * math.pi * turns[number] * phase
            circle = around[number] * np.array([sign * (1.0 - math.cos(angle)), math.sin(angle)])
            lifted = (2.0 + 2.0 * number) * RADIUS_M * float(smoothstep(np.array(10.0 * phase)))
            return np.array([circle[0] + sign * near * phase, circle[1], lifted]), np.array([0.0, 0.0, angle])

        return pose

    young = float(rng.uniform(1e5, 4e5))
    return Experiment(young, led(0), led(1), gravity=True, floor=True, elevation=(0.8, 1.4))


def _still(phase: float) -> Pose:
    return np.zeros(3), np.zeros(3)


EXPERIMENTS: Mapping[str, Callable[[np.random.Generator], Experiment]] = {
    "hangs": hangs,
    "bends": bends,
    "twists": twists,
    "buckles": buckles,
    "snaps back": snaps_back,
    "tangles": tangles,
}
