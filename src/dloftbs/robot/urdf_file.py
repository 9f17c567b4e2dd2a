"""Joints and collision geometry from a URDF."""

from __future__ import annotations

import importlib
from pathlib import Path
from typing import Any

import numpy as np

from dloftbs.errors import InputError, SourceError
from dloftbs.robot.bodies import Body
from dloftbs.robot.kinematics import DEFAULT_BASE, FIXED, SLIDING, TURNING, RobotJoint, checked_axis
from dloftbs.robot.robot_arguments import RobotArguments
from dloftbs.support.arrays import FloatArray

_ROUND = 32
"""Corners of a cylinder's ends; the polygon lies within half a percent of the radius.

Source: geometry.
"""


def read_urdf(path: Path) -> RobotArguments:
    """Return the joints, the bodies and the base of a robot.

    Raises
    ------
    SourceError
        As `RobotModel.from_urdf`.
    """
    try:
        yourdfpy = importlib.import_module("yourdfpy")
    except ImportError as missing:
        raise SourceError(f"{path}: a URDF needs yourdfpy: pip install 'dloftbs[robot]'") from missing
    if not path.is_file():
        raise SourceError(f"{path}: there is no such file")
    try:
        urdf = yourdfpy.URDF.load(str(path), build_scene_graph=False, load_meshes=False)
        joints = [_joint(one) for one in urdf.robot.joints]
        meshes = Path(path).parent
        links = urdf.robot.links
        bodies = [_body(link.name, one, path, meshes) for link in links for one in link.collisions]
    except SourceError:
        raise
    except InputError as error:
        raise SourceError(f"{path}: {error}") from error
    except Exception as error:  # of the XML parser and the reader, which have no base of their own
        raise SourceError(f"{path} is no URDF that can be read: {error}") from error
    return RobotArguments(joints, bodies, [], base=links[0].name if links else DEFAULT_BASE)


def _joint(joint: Any) -> RobotJoint:
    if joint.type not in (*TURNING, *SLIDING, *FIXED):
        raise InputError(f"joint {joint.name} is {joint.type}; known are {', '.join((*TURNING, *SLIDING, *FIXED))}")
    axis = np.array((1.0, 0.0, 0.0) if joint.axis is None else joint.axis, dtype=np.float64)
    mimic = None
    if joint.mimic is not None:
        factor, offset = joint.mimic.multiplier, joint.mimic.offset
        mimic = (joint.mimic.joint, 1.0 if factor is None else float(factor), 0.0 if offset is None else float(offset))
    axis = checked_axis(joint.name, joint.type, axis)
    return RobotJoint(joint.name, joint.type, joint.parent, joint.child, _pose(joint.origin), axis, mimic)


def _body(link: str, collision: Any, path: Path, meshes: Path) -> Body:
    shape, pose = collision.geometry, _pose(collision.origin)
    if shape.sphere is not None:
        return Body(link, np.zeros((1, 3)), float(shape.sphere.radius)).moved(pose)
    if shape.box is not None:
        signs = np.stack(np.meshgrid((-0.5, 0.5), (-0.5, 0.5), (-0.5, 0.5)), axis=-1).reshape(-1, 3)
        return Body(link, signs * np.asarray(shape.box.size, np.float64), 0.0).moved(pose)
    if shape.cylinder is not None:
        return Body(link, _cylinder(float(shape.cylinder.radius), float(shape.cylinder.length)), 0.0).moved(pose)
    if shape.mesh is not None:
        return Body(link, _mesh(shape.mesh, path, meshes), 0.0).moved(pose)
    raise InputError(f"link {link} has a collision geometry that is no box, cylinder, sphere or mesh")


def _cylinder(radius: float, length: float) -> FloatArray:
    angle = 2.0 * np.pi * np.arange(_ROUND) / _ROUND
    ring = radius * np.column_stack((np.cos(angle), np.sin(angle)))
    return np.concatenate([np.column_stack((ring, np.full(_ROUND, z))) for z in (-0.5 * length, 0.5 * length)])


def _mesh(mesh: Any, path: Path, folder: Path) -> FloatArray:
    """Return the corners of a mesh's convex hull."""
    trimesh, yourdfpy = (importlib.import_module(name) for name in ("trimesh", "yourdfpy"))
    place = Path(yourdfpy.filename_handler_magic(mesh.filename, dir=str(folder)))
    if not place.is_file():
        raise SourceError(f"{path}: the mesh {mesh.filename!r} is not there; it was looked for at {place}")
    corners = np.asarray(trimesh.load(str(place), force="mesh").convex_hull.vertices, dtype=np.float64)
    return corners if mesh.scale is None else corners * np.asarray(mesh.scale, dtype=np.float64)


def _pose(origin: FloatArray | None) -> FloatArray:
    return np.eye(4) if origin is None else np.asarray(origin, dtype=np.float64)
