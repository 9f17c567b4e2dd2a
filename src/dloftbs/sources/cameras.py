"""Cameras by the path of their device, as Linux has them."""

from __future__ import annotations

import glob
import os
import re
import stat
import sys

from dloftbs.errors import SourceError

_DEVICE = re.compile(r"/dev/video([0-9]{1,9})")


def camera_index(path: str) -> int | None:
    """Return the index of the camera that a path leads to, by whatever links; None where it leads to no device.

    Raises
    ------
    SourceError
        If it leads to another device, or is that of a camera that is not there.
    """
    real = os.path.realpath(path)
    found = _DEVICE.fullmatch(real)
    try:
        is_device = stat.S_ISCHR(os.stat(real).st_mode)
    except OSError as error:
        if found is None:
            return None  # whoever opens it says why not
        raise SourceError(f"there is no camera {path!r} ({error.strerror}); {cameras_here()}") from error
    if not is_device:
        return None
    if found is None:
        raise SourceError(
            f"{path!r} is a device, but no camera, which is named /dev/video0 and so on; {cameras_here()}"
        )
    return int(found[1])


def why_not(index: int) -> str:
    """Say why a camera cannot be opened, as far as the system shows."""
    if sys.platform != "linux":
        return "there is none of that index, or another program uses it"
    device = f"/dev/video{index}"
    if not os.path.exists(device):
        return f"there is no {device}; {cameras_here()}"
    if not os.access(device, os.R_OK | os.W_OK):
        return f"{device} may not be read and written by this user, who may have to join its group"
    return f"{device} is used by another program, or gives no pictures; {cameras_here()}"


def cameras_here() -> str:
    """Return the devices of cameras, for messages."""
    devices = sorted(name for name in glob.glob("/dev/video*") if _DEVICE.fullmatch(name))
    return f"cameras here: {', '.join(devices) or 'none'}"
