"""Compiled kernels on disk: damaged files, folders that cannot be written, and those that can be read all the same."""

from __future__ import annotations

import errno
import logging
import os

import pytest
from numba import float64, njit

from dloftbs.kernels import cache_places, kernel_cache
from dloftbs.kernels.kernel_cache import KernelCache


def half(x):
    return 0.5 * x


@pytest.fixture(autouse=True)
def places(tmp_path, monkeypatch):
    """Return the two folders where kernels may lie."""
    found = (tmp_path / "first", tmp_path / "second")
    monkeypatch.setattr(kernel_cache, "list_places", lambda folder: found)
    kernel_cache._warn_unsaved.cache_clear()
    return found


def compiled(stamp="a" * 64):
    """Return whether a kernel came from the cache; it is put there where it did not."""
    made = njit(no_cfunc_wrapper=True)(half)
    made._cache = KernelCache(half, stamp, lambda: None)
    made.compile((float64,))
    assert made(3.0) == 1.5
    return bool(made.stats.cache_hits)


def test_a_kernel_is_saved_once_and_then_read(places):
    assert [compiled(), compiled(), compiled()] == [False, True, True]
    assert len(list(places[0].iterdir())) == 1
    assert not places[1].exists()


@pytest.mark.parametrize(
    "damage",
    [
        pytest.param(lambda data: b"", id="empty"),
        pytest.param(lambda data: data[:3], id="shorter than its checksum"),
        pytest.param(lambda data: data[:4], id="a checksum alone"),
        pytest.param(lambda data: data[: len(data) // 2], id="cut off"),
        pytest.param(lambda data: data[:-1], id="a byte short"),
        pytest.param(lambda data: bytes(len(data)), id="zeros"),
        pytest.param(lambda data: data[:500] + bytes([data[500] ^ 1]) + data[501:], id="a wrong bit"),
        pytest.param(lambda data: data + b"x", id="a byte too many"),
    ],
)
def test_a_damaged_file_is_written_anew(places, damage):
    compiled()
    (file,) = places[0].iterdir()
    file.write_bytes(damage(file.read_bytes()))
    assert [compiled(), compiled()] == [False, True]
    assert list(places[0].iterdir()) == [file]


def test_a_file_that_cannot_be_read_is_compiled_again(places):
    compiled()
    (file,) = places[0].iterdir()
    file.unlink()
    file.mkdir()
    assert not compiled()
    assert compiled(), "it is in the second folder"
    assert [one.name for one in places[1].iterdir()] == [file.name]


def test_a_folder_that_cannot_be_written_is_read(places, monkeypatch):
    compiled()
    monkeypatch.setattr(kernel_cache, "_write", None)  # nothing is written
    assert compiled()


def test_what_the_first_folder_does_not_take_goes_to_the_second(places, caplog):
    places[0].write_text("not a folder")
    assert [compiled(), compiled()] == [False, True]
    assert len(list(places[1].iterdir())) == 1
    assert not caplog.records


@pytest.mark.parametrize("code", [errno.ENOSPC, errno.EDQUOT, errno.EROFS, errno.EACCES])
def test_a_kernel_that_cannot_be_saved_is_a_single_warning(places, monkeypatch, caplog, code):
    def refuse(self, target):
        raise OSError(code, os.strerror(code))

    monkeypatch.setattr("pathlib.Path.replace", refuse)
    with caplog.at_level(logging.WARNING, "dloftbs.kernels"):
        assert [compiled(), compiled(), compiled("b" * 64)] == [False, False, False]
    (record,) = caplog.records
    assert os.strerror(code) in record.getMessage()
    assert "NUMBA_CACHE_DIR" in record.getMessage()
    assert [list(place.iterdir()) for place in places] == [[], []], "no drafts are left"


def test_a_change_of_the_source_replaces_the_file(places):
    assert not compiled()
    (before,) = places[0].iterdir()
    assert not compiled("b" * 64)
    (after,) = places[0].iterdir()
    assert after != before


def test_what_is_stored_in_another_form_is_loaded_as_numba_does(monkeypatch):
    loaded = []
    monkeypatch.setattr(kernel_cache.CompileResult, "_rebuild", lambda *given: loaded.append(given))
    for payload in ((("name", "bitcode", b"code"), "described"), ("another form",)):
        kernel_cache._rebuild("context", payload)
    assert loaded == [("context", ("name", "bitcode", b"code"), "described"), ("context", "another form")]


@pytest.fixture
def home(tmp_path, monkeypatch):
    """Return a home and a temporary directory of a test's own, without NUMBA_CACHE_DIR."""
    monkeypatch.setattr(cache_places.config, "CACHE_DIR", "")
    monkeypatch.setenv("HOME", str(tmp_path / "home"))
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "home" / ".cache"))
    monkeypatch.setattr(cache_places.tempfile, "gettempdir", lambda: str(tmp_path / "temporary"))
    cache_places.list_places.cache_clear()
    yield tmp_path
    cache_places.list_places.cache_clear()


def tops(home, source):
    """Return the places of a folder, each by the top folder that it lies in."""
    return [place.relative_to(home).parts[0] for place in cache_places.list_places(source)]


def test_kernels_lie_beside_their_source_in_the_users_cache_or_in_a_private_folder(home):
    assert tops(home, home / "package") == ["package", "home", "temporary"]
    private = next((home / "temporary").iterdir())
    assert private.stat().st_mode & 0o777 == 0o700


def test_a_home_that_cannot_be_written_is_left_out(home):
    (home / "home").write_text("not a folder")
    assert tops(home, home / "package") == ["package", "temporary"]


@pytest.mark.skipif(not hasattr(os, "geteuid"), reason="owners and modes are those of POSIX")
@pytest.mark.parametrize("fault", ["writable by others", "a link", "of another user"])
def test_a_folder_that_another_user_may_write_is_not_used(home, monkeypatch, fault):
    cache_places.list_places(home / "package")
    (private,) = (home / "temporary").iterdir()
    cache_places.list_places.cache_clear()
    if fault == "writable by others":
        private.chmod(0o777)
    elif fault == "a link":
        private.rmdir()
        (home / "elsewhere").mkdir(mode=0o777)
        private.symlink_to(home / "elsewhere")
        os.chmod(home / "elsewhere", 0o777)
    else:
        (private.parent / f"dloftbs-{os.geteuid() + 1}").mkdir(mode=0o700)
        other = os.geteuid() + 1
        monkeypatch.setattr(os, "geteuid", lambda: other)
    assert "temporary" not in tops(home, home / "package")


def test_a_folder_of_the_users_choice_is_the_only_one(home, monkeypatch):
    monkeypatch.setattr(cache_places.config, "CACHE_DIR", str(home / "chosen"))
    assert tops(home, home / "package") == ["chosen"]


def test_a_folder_of_the_users_choice_that_cannot_be_written_is_read_first(home, monkeypatch):
    (home / "chosen").write_text("not a folder")
    monkeypatch.setattr(cache_places.config, "CACHE_DIR", str(home / "chosen"))
    assert tops(home, home / "package") == ["chosen", "package", "home", "temporary"]


def test_two_installations_share_no_file(home):
    first, second = (cache_places.list_places(home / name / "kernels")[1] for name in ("one", "two"))
    assert first != second
