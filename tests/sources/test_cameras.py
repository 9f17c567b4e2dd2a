"""Cameras by the path of their device."""

from __future__ import annotations

import os
import stat
from pathlib import Path
from types import SimpleNamespace

import cv2
import pytest

from dloftbs import sources
from dloftbs.errors import InputError, SourceError
from dloftbs.sources import cameras

linux = pytest.mark.skipif(not Path("/dev/null").exists(), reason="needs devices with paths")


@pytest.fixture
def devices(monkeypatch, tmp_path):
    """Let /dev/video0 and /dev/video2 be cameras; return what OpenCV is asked to open."""
    there = {"/dev/video0", "/dev/video2"}
    stat_of = os.stat
    character = SimpleNamespace(st_mode=stat.S_IFCHR | 0o660)
    monkeypatch.setattr(cameras.os, "stat", lambda path, **rest: character if path in there else stat_of(path, **rest))
    monkeypatch.setattr(cameras.glob, "glob", lambda pattern: sorted([*there, "/dev/video-codec"]))
    asked = []

    def capture(where):
        asked.append(where)
        return SimpleNamespace(isOpened=lambda: True, get=lambda key: 0.0, release=lambda: None)

    monkeypatch.setattr(cv2, "VideoCapture", capture)
    return asked


@pytest.mark.parametrize("where", ["/dev/video0", Path("/dev/video2"), "/dev/../dev/video0"])
def test_a_device_is_the_camera_of_its_index(devices, where):
    with sources.open(where) as source:
        assert isinstance(source, sources.LiveSource)
        assert source.live
        assert source.name == f"camera {devices[0]}"
    assert devices == [2 if isinstance(where, Path) else 0]


def test_links_lead_to_the_camera(devices, tmp_path):
    (tmp_path / "usb-camera").symlink_to("/dev/video2")
    sources.open(tmp_path / "usb-camera").close()
    assert devices == [2]


def test_what_cannot_go_with_a_camera_cannot_go_with_its_device(devices):
    with pytest.raises(InputError, match="fps cannot go with a camera"):
        sources.open("/dev/video0", fps=30)


def test_one_that_is_not_there_says_which_are(devices):
    with pytest.raises(
        SourceError, match=r"there is no camera '/dev/video9' .*; cameras here: /dev/video0, /dev/video2$"
    ):
        sources.open("/dev/video9")


@linux
def test_another_device_is_no_camera():
    with pytest.raises(SourceError, match="'/dev/null' is a device, but no camera, which is named /dev/video0"):
        sources.open("/dev/null")


def test_files_are_no_devices(tmp_path):
    (tmp_path / "video0").touch()
    assert cameras.camera_index(str(tmp_path / "video0")) is None
    assert cameras.camera_index("x" * 5000) is None


@pytest.mark.parametrize(
    ("platform", "exists", "access", "message"),
    [
        ("linux", False, False, "there is no /dev/video7; cameras here"),
        ("linux", True, False, "/dev/video7 may not be read and written by this user"),
        ("linux", True, True, "/dev/video7 is used by another program"),
        ("win32", True, True, "there is none of that index"),
    ],
)
def test_a_camera_that_cannot_be_opened_says_why(monkeypatch, platform, exists, access, message):
    monkeypatch.setattr(cameras.sys, "platform", platform)
    monkeypatch.setattr(cameras.os.path, "exists", lambda path: exists)
    monkeypatch.setattr(cameras.os, "access", lambda path, mode: access)
    monkeypatch.setattr(
        cv2, "VideoCapture", lambda where: SimpleNamespace(isOpened=lambda: False, release=lambda: None)
    )
    with pytest.raises(SourceError, match=f"camera 7 cannot be opened: {message}"):
        sources.open(7)
