"""Options that say how a frame is read: a colour, a region, a file of settings, and single settings."""

from __future__ import annotations

import functools
import os
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from dloftbs.cli.limits import MAX_OBJECTS, file_path
from dloftbs.errors import ConfigError, InputError

if TYPE_CHECKING:
    from dloftbs.config import Config, HsvRange, Roi

Command = Callable[..., None]


def parse_hsv(context: click.Context, parameter: click.Parameter, texts: tuple[str, ...]) -> tuple[HsvRange, ...]:
    """Read colours as `HsvRange.parse` does; a text that it refuses is bad usage."""
    if not texts:
        return ()
    from dloftbs.config import read_colour

    try:
        return read_colour(texts)
    except ConfigError as error:
        raise click.BadParameter(str(error), context, parameter) from error


def parse_roi(context: click.Context, parameter: click.Parameter, text: str | None) -> Roi | None:
    """Read a region of interest as `RegionConfig` does; a text that it refuses is bad usage."""
    if text is None:
        return None
    from dloftbs.config import read_roi

    try:
        return read_roi(text)
    except ConfigError as error:
        raise click.BadParameter(str(error), context, parameter) from error


roi_option = click.option(
    "--roi",
    metavar="X,Y,W,H|X,Y:X,Y:X,Y...",
    callback=parse_roi,
    help="Region of interest in pixels: a rectangle, or the corners of a polygon. The rest of the image is ignored. "
    "Curves stay in pixels of the whole image.",
)


def config_options(command: Command, *, beneath: str = "") -> Command:
    """Add the options that choose the configuration; the command gets the `Config` as `config`.

    What comes later in ``--paper``, ``--config``, ``--set``, ``--hsv``, ``--local``, ``--background``, ``--objects``,
    ``--min-confidence``, ``--mask-is``, ``--roi`` overrides what comes before.

    Parameters
    ----------
    command : callable
    beneath : str
        Argument of the command that names a file; if there is such a file, it is read before that of ``--config``.
    """

    @click.option(
        "--paper",
        is_flag=True,
        help="Start from the published method instead of the default. A file of --config that states another method, "
        "as a complete one does, is refused.",
    )
    @click.option(
        "--config",
        "config_file",
        type=file_path(),
        metavar="FILE",
        help="Read settings from a YAML file, as `dloftbs config print` writes it. Missing settings stay unchanged.",
    )
    @click.option(
        "--set",
        "changes",
        multiple=True,
        metavar="SECTION.KEY=VALUE",
        callback=parse_changes,
        help="Change one setting, such as linking.objects=1. The value is YAML. Repeatable.",
    )
    @click.option(
        "--hsv",
        multiple=True,
        metavar="COLOUR|H0:H1[,S0:S1[,V0:V1]]",
        callback=parse_hsv,
        help="Colour of a cable: a word (red, orange, yellow, green, cyan, blue, purple, magenta, pink, white, grey, "
        "black) or ranges on OpenCV's scale: hue 0..179, saturation and value 0..255. "
        "Hue wraps around: 170:10 is red. Saturation and value begin at 40 by default. Repeatable: "
        "a pixel in any range is cable.",
    )
    @click.option(
        "--local",
        type=click.Choice(("darker", "brighter")),
        help="Cables are darker, or brighter, than the ground beside them. If a colour is given, too, a pixel must "
        "meet both conditions (either one with --set segmentation.local.join=or).",
    )
    @click.option(
        "--background",
        type=file_path(),
        metavar="FILE",
        help="Picture of the place without cables, from `dloftbs background`; the camera must not move. "
        "Every difference counts as cable. A colour combines with it as with --local (segmentation.background.join).",
    )
    @click.option(
        "--objects",
        type=click.IntRange(1, MAX_OBJECTS),
        metavar="N",
        help="Number of cables, if known. Pieces are joined to N objects, and the rest is dropped.",
    )
    @click.option(
        "--branched",
        is_flag=True,
        help="Allow branches, as in wiring harnesses: three or more ends that meet may form a branch point.",
    )
    @click.option(
        "--min-confidence",
        type=click.FloatRange(0.0, 1.0),
        metavar="P",
        help="Bridge gaps of at least this probability. Default: 0.5. Other pieces stay apart, each with the other in "
        "its near_joints. 0 bridges all gaps that bend little.",
    )
    @click.option(
        "--mask-is",
        type=click.Choice(("auto", "binary", "probability", "labels")),
        help="Meaning of mask values: binary (any non-zero is cable), labels (object numbers) or probability (a "
        "network's output). auto reads many grey values, most of them near black or white, as a probability.",
    )
    @roi_option
    @functools.wraps(command)
    def with_config(
        *args: Any,
        paper: bool,
        config_file: Path | None,
        changes: dict[str, Any],
        hsv: tuple[HsvRange, ...],
        local: str | None,
        background: Path | None,
        objects: int | None,
        branched: bool,
        min_confidence: float | None,
        mask_is: str | None,
        roi: Roi | None,
        **kwargs: Any,
    ) -> None:
        if hsv and click.get_current_context().params.get("kind") == "mask":
            raise click.UsageError(
                "--hsv finds a colour in images, and --kind mask says that there are none: leave out one"
            )
        file = None if background is None else str(background)
        given = {
            "segmentation.local.tone": local,
            "segmentation.background.file": file,
            "linking.objects": objects,
            "linking.branched": branched or None,
            "linking.min_gap_confidence": min_confidence,
            "segmentation.mask_is": mask_is,
            "region.roi": roi,
        }
        changes = {**changes, **{key: value for key, value in given.items() if value is not None}}
        existing = kwargs.get(beneath)
        files = [Path(existing)] if existing is not None and os.path.exists(existing) else []
        files += [] if config_file is None else [config_file]
        command(*args, config=read_config(paper, files, changes, hsv), **kwargs)

    return with_config


def read_config(paper: bool, files: Sequence[Path], changes: dict[str, Any], hsv: tuple[HsvRange, ...]) -> Config:
    """Return the configuration that files and options ask for, the later ones overriding the earlier.

    Raises
    ------
    ConfigError
        If a file cannot be read, or a key or a value is wrong.
    click.UsageError
        As `stated_in`.
    """
    import msgspec

    from dloftbs.config import Config

    stated = [*(stated_in(file, paper=paper) for file in files), changes]
    # The published method has a form of its own for one cable: without a threshold, unless one is stated, too.
    one = {key: value for given in stated for key, value in given.items()}.get("linking.objects") == 1
    config = functools.reduce(Config.replace, stated, Config.paper(objects=1 if one else None) if paper else Config())
    return msgspec.structs.replace(config, segmentation=config.segmentation.with_hsv(hsv)) if hsv else config


def stated_in(file: Path, *, paper: bool) -> dict[str, Any]:
    """Return what a file states, by dotted path: what it leaves out is not the default but what came before.

    Raises
    ------
    ConfigError
        If the file cannot be read, or a key or a value is wrong.
    click.UsageError
        If it is to change the `paper`'s method, and states another one, whose settings would replace it unseen.
    """
    from dloftbs.config import Config
    from dloftbs.support.documents import parse_yaml, read_text

    Config.from_file(file)  # whose messages name the file
    (sections,) = parse_yaml(read_text(file)) or ({},)
    stated = {f"{section}.{key}": value for section, values in sections.items() for key, value in values.items()}
    for section, values in Config.paper().to_dict().items() if paper else ():
        key = f"{section}.method"
        if stated.get(key, values.get("method")) != values.get("method"):
            raise click.UsageError(
                f"{file} states {key}: {stated[key]}, but the published method has {values['method']}: keep only the "
                "sections segmentation and region of the file, or choose one of the two methods"
            )
    return stated


def parse_changes(context: click.Context, parameter: click.Parameter, texts: tuple[str, ...]) -> dict[str, Any]:
    """Read settings as ``SECTION.KEY=VALUE``, the value being YAML; what cannot be read is bad usage."""
    if not texts:
        return {}
    from dloftbs.support.documents import parse_yaml

    changes = {}
    for text in texts:
        key, equals, value = text.partition("=")
        if not equals or not key.strip():
            raise click.BadParameter(f"expected SECTION.KEY=VALUE, got {text!r}", context, parameter)
        try:
            documents = parse_yaml(value)
        except InputError as error:
            raise click.BadParameter(f"{value!r} is no YAML value: {error}", context, parameter) from error
        if len(documents) > 1:
            raise click.BadParameter(f"expected one value, got {value!r}", context, parameter)
        changes[key.strip()] = documents[0] if documents else None
    return changes
