"""Parameters as they arrive, and what they ask for."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, fields
from typing import Any, TypeVar

from dloftbs import Config, Pipeline
from dloftbs.data.answers import BendLimit, check_kinds
from dloftbs.errors import ConfigError
from dloftbs.ros.topic_choice import base_name

T = TypeVar("T", str, int, float)

RAW = "raw"
CHOICES = {
    "image_transport": (RAW, "compressed"),
    "depth_transport": (RAW, "compressedDepth", "compressed"),
    "reliability": ("auto", "reliable", "best_effort"),
}
"""Parameters of few values, and these."""


@dataclass(frozen=True)
class Parameters:
    """Parameters of the node, each under its name and with its default.

    Parameters
    ----------
    config : str
        File of settings, as ``dloftbs config`` prints them.
    hsv : str
        Colour, as on the command line.
    objects : int
        Number of cables; 0 if it is not known.
    roi : str
        Region of interest, as on the command line; empty for the whole image.
    image_transport, depth_transport : str
        Transports by which images and depth come; "raw" takes the topics as they are named.
    reliability : {"auto", "reliable", "best_effort"}
        Of subscriptions; "auto" takes the publisher's.
    frame_id : str
        Coordinate frame of the camera, in place of that of the images.
    target_frame : str
        Coordinate frame of curves in space; empty for the camera's.
    max_rate : float
        Frames a second at most; 0 for all.
    depth_unit : float
        Metres per count of integer depth.
    mask_topic : str
        Topic of the images' masks, as a segmenter publishes them; empty where there is none.
    min_bend_radius : str
        Least radius of bends, below which diagnostics warn, as on the command line; empty for none.
    robot : str
        File of a robot, YAML or URDF, that hides cables and holds their ends; empty for none.
    answers : str
        Answers to publish, after commas: topology, shape, std; empty for none.

    Raises
    ------
    ConfigError
        If one is out of its range.
    """

    config: str = ""
    hsv: str = ""
    objects: int = 0
    roi: str = ""
    image_transport: str = RAW
    depth_transport: str = RAW
    reliability: str = "auto"
    frame_id: str = ""
    target_frame: str = ""
    max_rate: float = 0.0
    depth_unit: float = 0.001
    mask_topic: str = ""
    min_bend_radius: str = ""
    robot: str = ""
    answers: str = ""

    def __post_init__(self) -> None:
        for name, choices in CHOICES.items():
            if getattr(self, name) not in choices:
                raise ConfigError(f"{name} must be {', '.join(choices)}, got {getattr(self, name)!r}")
        if not 0.0 <= self.max_rate < float("inf"):
            raise ConfigError(f"max_rate must be at least 0 frames a second, got {self.max_rate}")

    @classmethod
    def declared(cls, declare: Callable[[str, Any], Any]) -> Parameters:
        """Return the parameters that a node was started with.

        Parameters
        ----------
        declare : callable
            Declares a parameter by its name and default, and returns its value.

        Raises
        ------
        ConfigError
            If one is of another type or out of its range.
        """
        values = {field.name: declare(field.name, field.default) for field in fields(cls)}
        return cls(**{field.name: as_type(field.name, values[field.name], field.default) for field in fields(cls)})

    def topic(self, name: str, resolved: str) -> str:
        """Return the topic of an input, with that of its transport where one is asked for.

        Parameters
        ----------
        name : {"image", "depth", "camera_info"}
        resolved : str
            Its topic after remaps.
        """
        transport = {"image": self.image_transport, "depth": self.depth_transport}.get(name, RAW)
        return resolved if transport == RAW else f"{base_name(resolved)}/{transport}"

    def bend_limit(self) -> BendLimit | None:
        """Return the least radius of bends, or None.

        Raises
        ------
        InputError
            If it is none.
        """
        return BendLimit.parse(self.min_bend_radius) if self.min_bend_radius else None

    def answer_kinds(self) -> tuple[str, ...]:
        """Return the names of the answers to publish.

        Raises
        ------
        InputError
            If there is no such answer.
        """
        return check_kinds([kind.strip() for kind in self.answers.split(",")]) if self.answers else ()

    def make_pipeline(self) -> Pipeline:
        """Return the pipeline that is asked for; an empty text, or 0, leaves the choice to the configuration.

        Raises
        ------
        ConfigError
            If the colour or the region is wrong, or the configuration cannot be read.
        """
        config = Config.from_file(self.config) if self.config else None
        return Pipeline(config, hsv=self.hsv or None, objects=self.objects or None, roi=self.roi or None)


def as_type(name: str, value: Any, default: T) -> T:
    """Return the value of a parameter in the type of its default.

    On a command line the shape of a value makes its type: ``hsv:=1`` is an integer, ``max_rate:=5`` as well.

    Raises
    ------
    ConfigError
        If it cannot be taken for that.
    """
    kind = type(default)
    taken = {str: (str, int, float), int: (int,), float: (int, float)}[kind]
    if isinstance(value, bool) or not isinstance(value, taken):
        what = {str: "text", int: "an integer", float: "a number"}[kind]
        raise ConfigError(f"the parameter {name} must be {what}, got {value!r}")
    return kind(value)
