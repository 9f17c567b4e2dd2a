"""Each error is one of the package's and also the built-in one that it stands for."""

from __future__ import annotations

import pickle
import subprocess
import sys

import pytest

from dloftbs import errors

BUILT_IN = {
    errors.InputError: ValueError,
    errors.ConfigError: ValueError,
    errors.SourceError: OSError,
    errors.SinkError: OSError,
    errors.DependencyError: ImportError,
}


@pytest.mark.parametrize(("kind", "built_in"), BUILT_IN.items())
def test_an_error_is_caught_as_the_package_s_and_as_the_built_in(kind, built_in):
    for caught in (errors.DloftbsError, built_in, kind):
        with pytest.raises(caught, match=r"^what went wrong$"):
            raise kind("what went wrong")


@pytest.mark.parametrize("kind", BUILT_IN)
def test_an_error_is_none_of_its_siblings(kind):
    siblings = [other for other in BUILT_IN if other is not kind]
    assert not any(issubclass(kind, sibling) for sibling in siblings)


@pytest.mark.parametrize("kind", BUILT_IN)
def test_an_error_comes_whole_out_of_another_process(kind):
    error = pickle.loads(pickle.dumps(kind("what went wrong")))
    assert type(error) is kind
    assert str(error) == "what went wrong"


@pytest.mark.parametrize("kind", BUILT_IN)
def test_a_long_message_loses_its_middle(kind):
    error = kind(f"cannot read: {'x' * 76_000} at the end")
    assert str(error).startswith("cannot read: xxx")
    assert str(error).endswith("xxx at the end")
    assert " [72024 characters left out] " in str(error)
    assert str(kind("y" * 4000)) == "y" * 4000


def test_every_error_of_the_module_is_listed_here():
    defined = {value for value in vars(errors).values() if isinstance(value, type)}
    assert defined == {errors.DloftbsError, *BUILT_IN}


WITHOUT_OPENCV = "import sys; sys.modules['cv2'] = None\n"


def test_a_program_without_opencv_hears_what_to_install():
    tried = "try:\n    dloftbs.detect\nexcept ImportError as error:\n    print(repr(error))"
    code = f"{WITHOUT_OPENCV}import dloftbs\n{tried}"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.startswith("DependencyError(")
    assert "pip install 'dloftbs[headless]'" in done.stdout


@pytest.mark.parametrize("command", ["detect mask.png", "track cable.mp4", "warmup", "demo"])
def test_a_command_without_opencv_says_what_to_install(command, tmp_path):
    for name in ("mask.png", "cable.mp4"):
        (tmp_path / name).touch()
    code = f"{WITHOUT_OPENCV}sys.argv[1:] = {command.split()!r}\nfrom dloftbs.cli import main\nmain()"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, cwd=tmp_path, check=False)
    assert done.returncode == 1
    assert done.stderr.startswith("error: OpenCV is not installed. ")
    assert done.stderr.count("\n") == 1


def test_opencv_that_cannot_be_loaded_is_named_with_the_reason():
    broken = ImportError("libGL.so.1: cannot open shared object file", name="cv2")
    explained = errors.explain_import(broken)
    assert type(explained) is errors.DependencyError
    assert "libGL.so.1" in str(explained)
    assert "pip uninstall opencv-python" in str(explained)


def test_another_missing_module_is_reported_as_it_is():
    error = ModuleNotFoundError("No module named 'nonsense'", name="nonsense")
    assert errors.explain_import(error) is error
