"""``dloftbs colour``: strokes on a picture in, the section of the configuration that finds their colour out."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from dloftbs.cli.config_options import roi_option
from dloftbs.cli.input_options import topic_options
from dloftbs.cli.limits import MAX_FRAMES, FilledPath, file_path
from dloftbs.cli.output_options import check_png

if TYPE_CHECKING:
    from collections.abc import Sequence

    from dloftbs.config import ColourConfig, Roi, Stroke
    from dloftbs.data.frame_region import Region
    from dloftbs.support.arrays import ByteArray

SIGNATURE = "# A colour learned by dloftbs colour; dloftbs config print explains all settings"
_MAX_SET = 0.5  # of a picture, as in `plausibility`
_MISSED = 0.5  # of a stroke: more than the third that may lie beside what it means
_MAX_RADIUS_PX = 1000.0

_BESIDE = "; does it lie beside the cable? If it lies on it, add --accept-strokes"
_COMMON_COLOUR = (
    ", since the rest of the picture has its colours, too; add strokes on the ground with --not, and --accept-strokes "
    "to take all that lies beneath it"
)

Numbered = tuple[int, str]


def parse_strokes(context: click.Context, parameter: click.Parameter, texts: tuple[str, ...]) -> list[Numbered]:
    """Read ``[N@]X,Y[:X,Y...]`` as the number of the picture and the stroke; all else is bad usage."""
    found = []
    for text in texts:
        number, at, line = text.rpartition("@")
        if at and not (number.isdecimal() and 0 < int(number) <= MAX_FRAMES):
            raise click.BadParameter(f"expected the number of a picture before the @, got {text!r}", context, parameter)
        found.append((int(number) if at else 1, line))
    return found


@click.command(short_help="Learn a cable's colour from strokes on a picture.")
@click.argument("where", metavar="PICTURE...", nargs=-1, required=True, type=FilledPath())
@click.option(
    "--at",
    "cable",
    multiple=True,
    metavar="[N@]X,Y[:X,Y...]",
    callback=parse_strokes,
    help="A click on a cable, or a stroke along it, in pixels; 2@X,Y is in the second picture. Repeatable. A stroke "
    "is much better than a click.",
)
@click.option(
    "--not",
    "ground",
    multiple=True,
    metavar="[N@]X,Y[:X,Y...]",
    callback=parse_strokes,
    help="A click or a stroke on ground that looks like the cable.",
)
@click.option(
    "--radius",
    type=click.FloatRange(0.5, _MAX_RADIUS_PX),
    default=2.0,
    show_default=True,
    metavar="PX",
    help="Half the width of the strokes.",
)
@click.option(
    "--accept-strokes",
    is_flag=True,
    help="Count every colour under the strokes as cable, even if the rest of the picture has it, too.",
)
@roi_option
@topic_options
@click.option(
    "--frame",
    type=click.IntRange(0, MAX_FRAMES),
    default=0,
    metavar="N",
    help="Index of the frame in a video or folder.",
)
@click.option(
    "--config",
    "config_file",
    type=file_path(),
    metavar="FILE",
    help="Continue from a colour that was learned before. Its strokes count, too; other settings of the file stay.",
)
@click.option(
    "--out", "-o", type=FilledPath(), metavar="YAML", help="Write the settings to a file instead of standard output."
)
@click.option(
    "--overlay",
    type=FilledPath(),
    metavar="PNG",
    callback=check_png,
    help="Draw the mask over the pictures: cyan is cable.",
)
def colour(
    where: tuple[str, ...],
    cable: list[Numbered],
    ground: list[Numbered],
    radius: float,
    accept_strokes: bool,
    roi: Roi | None,
    topic: str | None,
    depth_topic: str | None,
    info_topic: str | None,
    frame: int,
    config_file: Path | None,
    out: str | None,
    overlay: str | None,
) -> None:
    """Learn a cable's colour from strokes on a picture, for --config of `detect` and `track`.

    PICTURE is an image, or any input of `dloftbs track` together with --frame. The settings go to standard output,
    messages to standard error. They hold the strokes and a count of the picture's colours; the picture is not
    needed at run time. With --roi they also hold the region, and only the colours in it.

    \b
    dloftbs colour photo.jpg --at 321,200:360,214:390,240 --overlay mask.png --out cable.yaml
    dloftbs colour other.jpg --at 90,55:130,70 --not 20,40 --config cable.yaml --out better.yaml
    dloftbs colour run.mcap --topic /camera/color/image_raw --frame 30 --at 90,55:130,70 --out cable.yaml
    """
    import msgspec
    import numpy as np

    from dloftbs.cli.colour_files import check_places, next_command, overlay_of, read_frame, source_of, stated_settings
    from dloftbs.config import ColourConfig, Config, read_roi
    from dloftbs.data.frame_region import Region
    from dloftbs.segmentation import ColourModel
    from dloftbs.support.documents import check_readable
    from dloftbs.support.safe_files import write_whole
    from dloftbs.viz import as_png

    check_places(where, config_file, out, overlay)
    stated, before = stated_settings(config_file)
    pictures = () if before is None else before.pictures
    strokes = _strokes(cable, ground, radius, len(where))
    if not pictures and not any(stroke.cable for given in strokes for stroke in given):
        raise click.UsageError("say where a cable is: --at X,Y, or along it, --at X,Y:X,Y:X,Y")
    topics = {"topic": topic, "depth_topic": depth_topic, "info_topic": info_topic}
    frames = [read_frame(text, frame, topics) for text in where]
    images = [one.image for one in frames if one.image is not None]
    sources = [source_of(text, one) for text, one in zip(where, frames, strict=True)]
    drawn_on = [entry for entry in zip(images, strokes, sources, strict=True) if entry[1]]
    if roi is not None:
        stated = {**stated, "region": {"roi": msgspec.to_builtins(roi)}}
    kept = Config.from_dict(stated).region.roi
    roi = None if kept is None else read_roi(kept)
    pictures = ColourModel.together((*pictures, *ColourModel.pictures_of(drawn_on, roi, pictures)))
    accepted = accept_strokes or (before is not None and before.accept_strokes)
    learned = before or ColourConfig(pictures=pictures)
    learned = msgspec.structs.replace(learned, pictures=pictures, accept_strokes=accepted)
    settings = {**stated, "segmentation": {**stated.get("segmentation", {}), "colour": msgspec.to_builtins(learned)}}
    Config.from_dict(settings)  # before it is written
    data = check_readable(f"{SIGNATURE}\n{msgspec.yaml.encode(settings).decode()}")
    if out is None:
        click.echo(data, nl=False)
    else:
        write_whole(Path(out), data)
    model = ColourModel(learned)
    regions = [None if roi is None else Region(roi, (image.shape[0], image.shape[1])) for image in images]
    masks = [
        (model(image) if region is None else region.paste(model(region.cut(image)))).view(np.uint8)
        for image, region in zip(images, regions, strict=True)
    ]
    for source, image, mask, region, given in zip(sources, images, masks, regions, strokes, strict=True):
        _report(source, float(mask.mean() if region is None else region.cut(mask).mean() / region.share), given)
        _report_missed(source, image, mask, given, region)
    _report_expected(learned, drawn_on, roi)
    if model.by_colour_alone:
        click.echo("the colour of each pixel decides alone, at the speed of a table", err=True)
    else:
        click.echo("colour, contrast and ridges decide, since the colour alone does not tell", err=True)
    if overlay is not None:
        write_whole(Path(overlay), as_png(overlay_of(images, masks, strokes)))
    save_first = "" if out else "save the settings by --out cable.yaml, then "
    click.echo(f"next: {save_first}{next_command(where, out, topics)}", err=True)


def _strokes(cable: list[Numbered], ground: list[Numbered], radius: float, pictures: int) -> list[list[Stroke]]:
    """Return the strokes on each picture.

    Raises
    ------
    click.BadParameter
        If one is no stroke, or on a picture that is not there.
    """
    from dloftbs.config import Stroke
    from dloftbs.errors import ConfigError

    found: list[list[Stroke]] = [[] for _ in range(pictures)]
    for option, is_cable, given in (("--at", True, cable), ("--not", False, ground)):
        for number, line in given:
            if number > pictures:
                raise click.BadParameter(f"{number}@{line}: there is no picture {number}", param_hint=option)
            try:
                found[number - 1].append(Stroke.parse(line, cable=is_cable, radius_px=radius))
            except ConfigError as error:
                raise click.BadParameter(str(error), param_hint=option) from error
    return found


def _report(source: str, share: float, strokes: Sequence[Stroke]) -> None:
    """Say how much of a picture counts as cable, and what to do where it is nothing or most."""
    hint = ""
    if share == 0.0:
        drawn = any(stroke.cable and len(stroke.points) > 1 for stroke in strokes)
        hint = ": nothing" if drawn else ": nothing; draw along the cable, --at X,Y:X,Y, rather than click on it"
    elif share > _MAX_SET:
        hint = ": the ground comes in; add strokes on it with --not"
    click.echo(f"{source}: {100.0 * share:.1f} % of the picture is cable{hint}", err=True)


def _report_missed(
    source: str, image: ByteArray, mask: ByteArray, strokes: Sequence[Stroke], region: Region | None
) -> None:
    """Say which strokes the mask contradicts, and why: they lie beside a cable, or its colour is the ground's, too."""
    import numpy as np

    from dloftbs.segmentation import lies_along_band, pixels_of

    inside = np.ones(mask.shape, np.bool_) if region is None else region.paste(np.ones(region.size, np.bool_))
    for stroke in strokes:
        drawn = pixels_of(mask.shape, [stroke]) & inside
        share = float((mask[drawn] != 0).mean()) if drawn.any() else 0.0
        if not drawn.any():
            finding = f"the stroke {stroke} lies outside the region of interest, where nothing is cable"
        elif stroke.cable and share < _MISSED:
            why = _COMMON_COLOUR if lies_along_band(image, stroke) else _BESIDE
            finding = f"only {100.0 * share:.0f} % of the stroke {stroke} counts as cable{why}"
        elif not stroke.cable and share > _MISSED:
            finding = f"{100.0 * share:.0f} % of the stroke {stroke} still counts as cable; does it lie on the cable?"
        else:
            continue
        click.echo(f"{source}: {finding}", err=True)


def _report_expected(
    learned: ColourConfig, drawn_on: Sequence[tuple[ByteArray, list[Stroke], str]], roi: Roi | None
) -> None:
    """Say how much of the cables the model is expected to find, by leaving each stroke out in turn."""
    from dloftbs.segmentation import cross_validate

    first = len(learned.pictures) - len(drawn_on)
    for number, (image, strokes, source) in enumerate(drawn_on, first):
        expected = cross_validate(image, strokes, learned, number, roi)
        if expected is not None:
            click.echo(
                f"{source}: expected to find {100.0 * expected.cable:.0f} % of the cables, and "
                f"{100.0 * expected.ground:.0f} % of the ground beside them (each stroke left out in turn)",
                err=True,
            )
