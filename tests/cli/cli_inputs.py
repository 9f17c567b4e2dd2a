"""Small inputs, and ways to run the command."""

import signal
import subprocess
import sys
from inspect import signature
from pathlib import Path

import cv2
import numpy as np
from click.testing import CliRunner

from dloftbs.cli import main

COMMAND = Path(sys.executable).with_name("dloftbs")
RED = "170:10,80:255,60:255"
# From click 8.2 on the two outputs are always apart.
RUNNER = CliRunner(**({"mix_stderr": False} if "mix_stderr" in signature(CliRunner).parameters else {}))


def run(*arguments, code=0):
    """Run the command in this process; the exit code must be as stated."""
    result = RUNNER.invoke(main, [str(argument) for argument in arguments])
    if result.exception is not None and not isinstance(result.exception, SystemExit):
        raise result.exception
    assert result.exit_code == code, result.output
    return result


def start(*arguments, **options):
    """Start the command in a process of its own, which heeds Ctrl-C even if this one was told not to."""
    command = [str(COMMAND), *(str(argument) for argument in arguments)]
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True}
    return subprocess.Popen(command, preexec_fn=_heed, **pipes, **options)  # noqa: PLW1509 - no thread holds a lock


def _heed():
    signal.signal(signal.SIGINT, signal.SIG_DFL)


def mask(y=50, size=(100, 200)):
    pixels = np.zeros(size, np.uint8)
    pixels[y - 2 : y + 3, 20 : size[1] - 20] = 255
    return pixels


def photo(y=50, size=(100, 200), colour=(0, 0, 255)):
    pixels = np.full((*size, 3), (90, 120, 90), np.uint8)
    pixels[mask(y, size) > 0] = colour
    return pixels


def save(path, pixels):
    path.parent.mkdir(parents=True, exist_ok=True)
    assert cv2.imwrite(str(path), pixels)
    return path
