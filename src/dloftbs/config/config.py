"""The whole configuration: its sections, and its ways to and from plain values and YAML."""

from __future__ import annotations

import os
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import msgspec

from dloftbs.config.cleaning import CleaningConfig
from dloftbs.config.explained import comment, meanings, meant, summary
from dloftbs.config.fitting import FittingConfig
from dloftbs.config.lifting import LiftingConfig, PixelLiftingConfig
from dloftbs.config.linking import GreedyLinkingConfig, LinkingConfig
from dloftbs.config.region import RegionConfig, RoiLike, read_roi
from dloftbs.config.section import Section, require
from dloftbs.config.segmentation import Colour, HsvRange, SegmentationConfig
from dloftbs.config.skeleton import SegmentsConfig
from dloftbs.config.tracking import NearestTrackingConfig, TrackingConfig
from dloftbs.errors import ConfigError, InputError
from dloftbs.support.documents import parse_yaml, read_text
from dloftbs.support.values import as_integer, check_path, shown

_METHODS: dict[str, tuple[type[Section], ...]] = {
    "linking": (LinkingConfig, GreedyLinkingConfig),
    "lifting": (LiftingConfig, PixelLiftingConfig),
    "tracking": (TrackingConfig, NearestTrackingConfig),
}
"""Sections with several methods, the default one first."""

_WITHIN = {
    "segmentation.plane": "height_m",
    "segmentation.onnx": "file",
    "segmentation.local": "tone",
    "segmentation.background": "file",
}
"""Sections within one, which are left out by default, each with the setting that a value in its place stands for."""


class Config(Section, frozen=True, kw_only=True):
    """The whole configuration, a section per stage.

    Examples
    --------
    >>> Config().replace({"fitting.knots": 40}).fitting.knots
    40
    """

    region: RegionConfig = RegionConfig()
    segmentation: SegmentationConfig = SegmentationConfig()
    cleaning: CleaningConfig = CleaningConfig()
    segments: SegmentsConfig = SegmentsConfig()
    linking: LinkingConfig | GreedyLinkingConfig = LinkingConfig()
    fitting: FittingConfig = FittingConfig()
    lifting: LiftingConfig | PixelLiftingConfig = LiftingConfig()
    tracking: TrackingConfig | NearestTrackingConfig = TrackingConfig()

    def __post_init__(self) -> None:
        for name, default in zip(self.__struct_fields__, self.__struct_defaults__, strict=True):
            kinds = _METHODS.get(name, (type(default),))
            expected = " or ".join(f"a {kind.__name__}" for kind in kinds)
            require(isinstance(getattr(self, name), kinds), name, expected, getattr(self, name))

    @classmethod
    def paper(cls, *, objects: int | None = None) -> Config:
        """Return the published method with its parameters (``m = 0.05``, ``p = 10``, ``k = 25``).

        Parameters
        ----------
        objects : int, optional
            Number of cables. With 1 it is the authors' form for one cable, which joins all segments; otherwise
            the one for several, with ``J_th = 2``.

        Raises
        ------
        ConfigError
            If `objects` is no integer of at least 1.
        """
        one = as_integer(objects) == 1  # what is no number is refused below
        return cls(
            cleaning=CleaningConfig(open_px=3, close_px=1, thin_px=0, fill_holes=False),
            linking=GreedyLinkingConfig(
                objects=objects,
                min_length_px=10,
                min_length_widths=0.0,
                distance_weight=0.05,
                max_cost=None if one else 2.0,
                direction_px=10,
            ),
            fitting=FittingConfig(knots=25),
            lifting=PixelLiftingConfig(),
            tracking=NearestTrackingConfig(),
        )

    @classmethod
    def from_dict(cls, data: Mapping[str, Any]) -> Config:
        """Build a configuration from nested dictionaries; omitted values keep their defaults.

        The sections `linking`, `lifting` and `tracking` may name their ``method``: ``"bending"`` or ``"greedy"``,
        ``"axis"`` or ``"pixels"``, ``"motion"`` or ``"nearest"``; it is the first one, where they do not.

        Raises
        ------
        ConfigError
            On an unknown key, a wrong type or a value out of range, with the path of the culprit.
        """
        if isinstance(data, Mapping):
            data = {key: dict(part) if isinstance(part, Mapping) else part for key, part in data.items()}
        for name, (default, *_) in _METHODS.items():
            section = data.get(name) if isinstance(data, dict) else None
            if isinstance(section, dict) and "method" not in section:
                data = {**data, name: {"method": default.__struct_config__.tag, **section}}
        try:
            return msgspec.convert(_with_ranges(data), cls)
        except msgspec.ValidationError as error:
            raise ConfigError(f"{error}{_meant_instead(str(error))}") from error
        except IndexError as error:  # msgspec 0.22 takes numpy's values for sequences
            told = "a value of numpy is none of a configuration: convert it to Python's by .item() or .tolist()"
            raise ConfigError(told) from error

    @classmethod
    def from_yaml(cls, text: str) -> Config:
        """Read YAML text; what it leaves out keeps its default.

        Raises
        ------
        ConfigError
            If it is no YAML, or says what `from_dict` refuses.
        """
        require(isinstance(text, str), "text", "YAML text (a file is read by Config.from_file)", text)
        try:
            documents = parse_yaml(text, once=True)
        except InputError as error:
            raise ConfigError(f"cannot read the configuration: {error}") from error
        if len(documents) > 1:
            raise ConfigError(f"must hold one configuration, found {len(documents)} documents")
        settings = documents[0] if documents else {}
        if isinstance(settings, str):  # any text is YAML
            raise ConfigError(
                f"holds text in place of settings, {shown(settings)}; "
                "they are written as `dloftbs config print` has them"
            )
        return cls.from_dict(settings)

    @classmethod
    def from_file(cls, path: str | Path) -> Config:
        """Read a YAML file.

        Raises
        ------
        ConfigError
            If the file cannot be read, is no YAML, or says what `from_dict` refuses.
        """
        require(isinstance(path, (str, Path)), "path", "the path of a YAML file", path)
        try:
            return cls.from_yaml(read_text(check_path("path", path)))
        except (InputError, ConfigError) as error:
            raise ConfigError(f"{path}: {error}") from error

    def to_dict(self) -> dict[str, Any]:
        """Return nested dictionaries of plain values, ready for JSON, as `from_dict` takes them."""
        # By way of JSON, which turns tuples into lists.
        result: dict[str, Any] = msgspec.json.decode(msgspec.json.encode(self))
        result["segmentation"]["hsv"] = [str(colours) for colours in self.segmentation.hsv]
        return result

    def to_yaml(self) -> str:
        """Return the configuration as YAML text, every value stated."""
        return msgspec.yaml.encode(self.to_dict()).decode()

    def explain(self) -> str:
        """Return the configuration as YAML text, every value stated beneath its meaning."""
        lines = []
        for name, values in self.to_dict().items():
            section = getattr(self, name)
            explained = meanings(type(section))
            lines += [*comment(summary(type(section))), f"{name}:" + " {}" * (not values)]
            for key, value in values.items():
                entry = msgspec.yaml.encode({key: value}).decode().splitlines()
                lines += [f"  {line}" for line in (*comment(explained.get(key, "")), *entry)]
            lines.append("")
        return "\n".join(lines)

    def with_roi(self, roi: RoiLike | None) -> Config:
        """Return a copy with another region of interest; None reads the whole image.

        Raises
        ------
        ConfigError
            If it is no region, as `RegionConfig` has it.
        """
        region = RegionConfig(roi=None if roi is None else read_roi(roi))
        return msgspec.structs.replace(self, region=region)

    def replace(self, changes: dict[str, Any]) -> Config:
        """Return a copy with the values at dotted paths replaced, checked as a whole.

        A section that gets another method keeps the settings that both methods have.

        Parameters
        ----------
        changes : dict of str to value
            For example ``{"linking.objects": 2}``.

        Raises
        ------
        ConfigError
            As `from_dict`.
        """
        valid = isinstance(changes, dict) and all(isinstance(path, str) for path in changes)
        require(valid, "changes", "a dictionary of values by dotted paths", changes)
        data = self.to_dict()
        for name, (one, other) in _METHODS.items():
            method = changes.get(f"{name}.method")
            if method not in (None, data[name]["method"]):
                kept = {key: data[name][key] for key in one.__struct_fields__ if key in other.__struct_fields__}
                data[name] = type(self).from_dict({name: {"method": method}}).to_dict()[name] | kept
        for path, value in changes.items():
            *parents, key = path.split(".")
            section: Any = data
            if (within := ".".join(parents)) in _WITHIN:
                whole = data[parents[0]][parents[1]]
                if whole is None or isinstance(whole, (dict, str)):
                    stated = {_WITHIN[within]: whole} if isinstance(whole, str) else whole or {}
                    data[parents[0]][parents[1]] = {**stated, key: value}
                    continue  # `from_dict` knows its keys
            for parent in parents:
                section = section.get(parent) if isinstance(section, dict) else None
            if not isinstance(section, dict) or key not in section:
                raise ConfigError(f"unknown configuration key {shown(path)}{meant(path, _keys())}")
            section[key] = value
        return type(self).from_dict(data)


ConfigLike = Config | str | os.PathLike[str] | Mapping[str, Any]
"""Configurations as users have them: one, the path of a YAML file, or the dictionary that `Config.from_dict` takes."""


def choose_config(
    config: ConfigLike | None,
    hsv: Colour | None,
    objects: int | None,
    roi: RoiLike | None = None,
    mask_is: str | None = None,
    branched: bool | None = None,
) -> Config:
    """Return a configuration, by default the package's, with what is chosen beside it: see `Pipeline`.

    Raises
    ------
    InputError
        If the configuration is something else.
    ConfigError
        If its file cannot be read, or a value is wrong.
    """
    config = Config() if config is None else _as_config(config)
    if hsv is not None:
        config = msgspec.structs.replace(config, segmentation=config.segmentation.with_hsv(hsv))
    if roi is not None:
        config = config.with_roi(roi)
    if mask_is is not None:
        config = config.replace({"segmentation.mask_is": mask_is})
    if branched is not None:
        config = config.replace({"linking.branched": branched})
    return config if objects is None else config.replace({"linking.objects": objects})


def _as_config(config: ConfigLike) -> Config:
    if isinstance(config, Config):
        return config
    if isinstance(config, str) and "\n" in config:
        raise InputError(
            "config must be the path of a YAML file, got text of several lines: pass Config.from_yaml(text)"
        )
    if isinstance(config, (str, os.PathLike)):
        return Config.from_file(Path(os.path.expanduser(os.fsdecode(config))))
    if isinstance(config, Mapping):
        return Config.from_dict(config)
    raise InputError(f"config must be a Config, the path of a YAML file or a dictionary, got {shown(config)}")


def _with_ranges(data: Any) -> Any:
    """Return the data with the notation of colour ranges read; all else is as it was."""
    section = data.get("segmentation") if isinstance(data, dict) else None
    if not isinstance(section, dict):
        return data
    given = section.get("hsv")
    parts = [given] if isinstance(given, str) else given
    if not isinstance(parts, (list, tuple)):
        return data
    boxes = []
    for place, part in enumerate(parts):
        try:
            boxes.append(HsvRange.parse(part) if isinstance(part, str) else part)
        except ConfigError as error:
            raise ConfigError(f"{error} - at `$.segmentation.hsv[{place}]`") from error
    return {**data, "segmentation": {**section, "hsv": boxes}}


def _keys() -> dict[str, str]:
    """Return the sections and the dotted keys of all methods, each with the method that alone has it, if so."""
    keys = {}
    for name, default in zip(Config.__struct_fields__, Config.__struct_defaults__, strict=True):
        keys[name] = ""
        kinds = _METHODS.get(name, (type(default),))
        for kind in reversed(kinds):  # of a key of several methods, the default's name stands
            method = kind.__struct_config__.tag if len(kinds) > 1 else ""
            keys |= {f"{name}.{key}": f"{name}.method={method}" * bool(method) for key in kind.__struct_fields__}
            keys |= {f"{name}.method": ""} if method else {}
    return keys


def _meant_instead(message: str) -> str:
    """Return what was meant by the key that a message calls unknown; nothing for any other message."""
    unknown = re.search(r"unknown field `([^`]*)`(?: - at `\$\.(\w+)`)?$", message)
    if unknown is None:
        return ""
    key, section = unknown.groups()
    return meant(f"{section}.{key}" if section else key, _keys())
