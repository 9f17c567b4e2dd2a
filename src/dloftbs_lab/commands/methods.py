"""Methods to be scored, by name: the package's own, with any configuration, and anybody's function."""

from __future__ import annotations

import functools
import hashlib
import importlib
import inspect
import logging
import os
import sys
import sysconfig
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import replace
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING, Any, cast

import msgspec

from dloftbs.config import Config, HsvRange, LinkingConfig, SegmentationConfig
from dloftbs.data.frame import Frame
from dloftbs.data.frame_result import FrameResult
from dloftbs.errors import ConfigError, InputError
from dloftbs.support.file_digest import file_digest
from dloftbs_lab.commands.method_options import MethodSettings
from dloftbs_lab.evaluation.baselines import LENGTHS, CoherentPointDrift
from dloftbs_lab.evaluation.runner.sequence_run import Method
from dloftbs_lab.evaluation.suites import TWO_CAMERAS
from dloftbs_lab.synthetic import TwoViewFrame

if TYPE_CHECKING:
    from dloftbs.stereo import StereoPipeline

logger = logging.getLogger("dloftbs.cli")

BUILT_IN = ("default", "paper")
BASELINES = ("cpd",)
STEREO = "stereo"
"""`dloftbs.StereoPipeline`, for the suite of two cameras."""
BASELINE_SUITES = ("rgb", "rgbd", "rgbd-artificial")
"""Suites of one cable whose length does not change."""
_INSTALLED = {"site-packages", "dist-packages"}
_NO_CODE = {*_INSTALLED, "__pycache__", "build", "dist", "node_modules"}
"""Names of folders whose code is made or installed."""
_MAX_FOLDERS = 1000
"""Number of folders in which code of a method is looked for.

Source: by hand; far more than a project has, and listed in a tenth of a second.
"""
CONFIG_SUFFIXES = (".yaml", ".yml")


def methods_of(names: Sequence[str], settings: MethodSettings) -> list[Method]:
    """Return methods by their names, as `method_of` does.

    Raises
    ------
    ConfigError, InputError
        As `method_of`; and if there are settings, but no method that takes them.
    """
    methods = [method_of(name, settings) for name in names]
    if settings.options and all(config_of(name, settings) is None for name in names):
        raise InputError(
            f"{' and '.join(settings.options)}: none of the methods takes settings; those that do are "
            f"{', '.join(BUILT_IN)} and YAML files, got {', '.join(names)}"
        )
    return methods


def method_of(name: str, settings: MethodSettings | None = None) -> Method:
    """Return a method by its name.

    Parameters
    ----------
    name : str
        "default"; "paper", in sequences of one cable the authors' form for one; the baseline "cpd"; "stereo", for the
        suite two-cameras; a YAML file with a configuration; or ``module:callable``: a function from a `Frame` to
        curves, or a class, of which an instance is made for each sequence and called in this way, after its
        ``start(frame, truth)`` if it has one.
    settings : MethodSettings, optional
        Apply to all but the last.

    Raises
    ------
    ConfigError
        If the file or the settings are wrong.
    InputError
        If there is no such method, or its module cannot be imported.
    """
    config = config_of(name, settings or MethodSettings())
    if config is not None:
        one = _for_one(config) if name == "paper" else None
        if one is None:
            branched = _branched(config)
            return Method(
                name,
                functools.partial(_pipeline, config),
                _settings(config),
                branched_factory=None if branched is None else functools.partial(_pipeline, branched),
            )
        settings_of_both = f"{_settings(config)}\n{one.to_yaml()}"
        both = functools.partial(_pipeline, config), functools.partial(_pipeline, one)
        return Method(name, both[0], settings_of_both, one_factory=both[1])
    if name in BASELINES:
        first, *others = (functools.partial(CoherentPointDrift, length) for length in LENGTHS)
        return Method(name, first, alternatives=tuple(others), suites=BASELINE_SUITES)
    if name == STEREO:
        return Method(name, _TwoCameras, suites=(TWO_CAMERAS,))
    module_name, colon, _ = name.partition(":")
    if not colon:
        raise InputError(
            f"there is no method {name!r}; methods are {', '.join((*BUILT_IN, *BASELINES, STEREO))}, a configuration "
            "(FILE.yaml) and module:callable"
        )
    found = _imported(name)
    if not callable(found) or (inspect.isclass(found) and "__call__" not in dir(found)):
        raise InputError(f"method {name!r} must be a function, or a class whose instances can be called, got {found!r}")
    hsv = () if settings is None else settings.hsv
    digest = _digest(importlib.import_module(module_name))
    return Method(name, functools.partial(_strangers, name, hsv), f"{digest} {hsv}" if hsv else digest)


@contextmanager
def current_folder_importable() -> Iterator[None]:
    """Let Python find modules in the current folder first, as ``python -m`` does, for as long as the block runs.

    Processes that are started in the block find them for good. Modules may import others when they are called, so that
    the block has to hold the calls, too.
    """
    here = os.getcwd()
    if here in sys.path:
        yield
        return
    sys.path.insert(0, here)
    try:
        yield
    finally:
        with suppress(ValueError):  # a stranger's module may have put the path in order itself
            sys.path.remove(here)


def config_of(name: str, settings: MethodSettings) -> Config | None:
    """Return the configuration of a method by its name; None for a function or a class.

    Raises
    ------
    ConfigError
        If the file or the settings are wrong.
    """
    if name not in BUILT_IN and not name.lower().endswith(CONFIG_SUFFIXES):
        return None
    base = None if name in BUILT_IN else Path(os.path.expanduser(name))
    try:
        return settings.applied_to(base, paper=name == "paper")
    except ConfigError as error:
        raise ConfigError(f"method {name!r}: {error}") from error


def _for_one(config: Config) -> Config | None:
    """Return the authors' form for one cable, which joins all segments; None where their linking was set otherwise."""
    if config.linking != Config.paper().linking:
        return None
    return msgspec.structs.replace(config, linking=Config.paper(objects=1).linking)


def _branched(config: Config) -> Config | None:
    """Return the form for objects that branch; None where the linking knows none, or their number is stated."""
    if not isinstance(config.linking, LinkingConfig) or config.linking.objects is not None:
        return None
    return config.replace({"linking.branched": True})


def _pipeline(config: Config) -> Callable[[Frame], FrameResult]:
    from dloftbs.pipeline import Pipeline

    process = Pipeline(config).process
    return functools.partial(_by_colour, process) if config.segmentation.is_given else process


class _TwoCameras:
    """`dloftbs.StereoPipeline` with the rig of the first frame."""

    def __init__(self) -> None:
        self._pipeline: StereoPipeline | None = None

    def __call__(self, frame: Frame) -> FrameResult:
        from dloftbs.stereo import CameraRig, StereoPipeline

        assert isinstance(frame, TwoViewFrame)
        assert frame.camera is not None
        assert frame.second is not None
        assert frame.second.camera is not None
        if self._pipeline is None:
            cameras = [frame.camera, frame.second.camera]
            std_deg, std_px = frame.rotation_std_deg, frame.pixel_std
            rig = CameraRig(cameras, frame.poses, rotation_std_deg=std_deg, pixel_std=std_px)
            self._pipeline = StereoPipeline(rig)
        return self._pipeline.process([frame, frame.second]).as_frame_result()


def _by_colour(process: Callable[[Frame], FrameResult], frame: Frame) -> FrameResult:
    """Process the picture of a frame by the colour of its cables, in place of a mask that it has."""
    return process(frame if frame.image is None else replace(frame, mask=None))


def _strangers(name: str, hsv: tuple[HsvRange, ...] = ()) -> Callable[[Frame], Any]:
    found = _imported(name)
    made = found() if inspect.isclass(found) else found
    return cast(Callable[[Frame], Any], Masked(made, hsv) if hsv else made)


class Masked:
    """A method that gets the mask by colour, as the package's own methods find it, in place of one that a frame has.

    Parameters
    ----------
    method : callable
    hsv : tuple of HsvRange
    """

    def __init__(self, method: Any, hsv: tuple[HsvRange, ...]) -> None:
        from dloftbs.segmentation import HsvSegmenter

        self._method = method
        self._segment = HsvSegmenter(SegmentationConfig(hsv=hsv))
        if hasattr(method, "start"):
            self.start = lambda frame, truth: method.start(self._with_mask(frame), truth)

    def __call__(self, frame: Frame) -> Any:
        """Return the curves that the method finds in a frame."""
        return self._method(self._with_mask(frame))

    def _with_mask(self, frame: Frame) -> Frame:
        return frame if frame.image is None else replace(frame, mask=self._segment(frame.image))


def _imported(name: str) -> Any:
    module_name, _, attribute = name.partition(":")
    try:
        module = importlib.import_module(module_name)
    except (Exception, SystemExit) as error:  # a stranger's module may raise anything
        what = f"method {name!r}: cannot import {module_name!r}: {type(error).__name__}: {error}"
        raise InputError(f"{what}{_import_hint(module_name, error)}") from error
    try:
        return functools.reduce(getattr, attribute.split("."), module)
    except AttributeError as error:
        raise InputError(f"method {name!r}: {error}") from error


def _import_hint(module_name: str, error: BaseException) -> str:
    """Return what to do where the module itself, rather than one that it imports, is not there."""
    if not isinstance(error, ModuleNotFoundError) or not module_name.startswith(error.name or "?"):
        return ""
    if module_name.endswith(".py"):
        return "; name a module without .py"
    return f"; modules are looked for in the current folder, {os.getcwd()}, and where Python finds others (PYTHONPATH)"


def _settings(config: Config) -> str:
    """Return a configuration, with digests of the files that it names."""
    return "\n".join([config.to_yaml(), *map(file_digest, config.segmentation.files)])


def _digest(module: ModuleType) -> str:
    """Return what changes when the module's file does, or code that it may import when it is called.

    That is code below the current folder, and below the module's own or that of its package.
    """
    if getattr(module, "__file__", None) is None:
        return ""
    file = Path(cast(str, module.__file__)).resolve()
    code = {file}
    if not _is_installed(file):
        package = importlib.import_module(module.__name__.partition(".")[0])
        for folder in (os.getcwd(), *getattr(package, "__path__", [file.parent])):
            code.update(_code_below(Path(folder).resolve()))
    digest = hashlib.sha256()
    for path in sorted(code):
        digest.update(f"{path.name} {file_digest(path)}\n".encode(errors="surrogateescape"))
    return digest.hexdigest()[:12]


def _is_installed(file: Path) -> bool:
    """Return whether a file changes with an installation, not by an edit."""
    return bool(_INSTALLED & set(file.parts)) or file.is_relative_to(Path(sysconfig.get_path("stdlib")).resolve())


def _code_below(root: Path) -> Iterator[Path]:
    """Yield the Python files in a folder and in those below it, the nearest first."""
    folders = deque([root])
    for _ in range(_MAX_FOLDERS):
        if not folders:
            return
        inside = _entries(folders.popleft())
        yield from (path for path in inside if path.suffix == ".py")
        folders.extend(path for path in inside if path.is_dir() and not path.is_symlink() and _may_hold_code(path))
    logger.warning(
        "%s holds more than %d folders: a change of code in the farthest is not noticed where results are resumed; "
        "start in a smaller folder, or with another --out",
        root,
        _MAX_FOLDERS,
    )


def _entries(folder: Path) -> list[Path]:
    """Return what is in a folder, by name; nothing where it cannot be read."""
    try:
        return sorted(folder.iterdir())
    except OSError:
        return []


def _may_hold_code(folder: Path) -> bool:
    """Return whether a folder may hold code of the user: it is not hidden, built or a virtual environment."""
    return not (folder.name.startswith(".") or folder.name in _NO_CODE or (folder / "pyvenv.cfg").exists())
