"""Selection of the centre lines that are objects."""

from __future__ import annotations

from collections.abc import Sequence

from dloftbs.config import LinkingConfig, ObjectsConfig
from dloftbs.data.centerline import Centerline
from dloftbs.data.dropped import Dropped
from dloftbs.data.prediction import Prediction
from dloftbs.linking.existence import expectations_of, with_existence


def choose(
    lines: Sequence[Centerline], config: ObjectsConfig, predicted: Sequence[Prediction] = ()
) -> tuple[list[Centerline], tuple[Dropped, ...]]:
    """Leave out objects that are too short or rather no cables; keep the longest where their number is known.

    Parameters
    ----------
    lines : sequence of Centerline
        Of either method.
    config : ObjectsConfig
    predicted : sequence of Prediction, optional
        Curves that are expected in the frame: what lies along one is a cable by itself, or the one that is expected.

    Returns
    -------
    kept : list of Centerline
        In the order given.
    dropped : tuple of Dropped
        Objects that are long enough, but are rather no cables, or exceed the number.
    """
    found = [line for line in lines if _length(line) >= _least(line, config) or line.branch_ends != (None, None)]
    if isinstance(config, LinkingConfig):  # the published method believes in all
        found = with_existence(found)
    kept, why = set(range(len(found))), ""
    if config.objects is not None:
        kept = set(sorted(kept, key=lambda k: -_length(found[k]))[: config.objects])
        why = f"it is one more than linking.objects = {config.objects}, and shorter"
    elif isinstance(config, LinkingConfig):
        kept -= _find_debris(found, config.min_probability, predicted)
        why = f"it is less probably a cable than linking.min_probability = {config.min_probability:g}"
    dropped = [Dropped(line, why, line.existence) for k, line in enumerate(found) if k not in kept]
    return [line for k, line in enumerate(found) if k in kept], tuple(dropped)


def _find_debris(lines: Sequence[Centerline], least: float, predicted: Sequence[Prediction]) -> set[int]:
    """Return which objects are less probably than that a cable, be it by themselves or one that is expected."""
    doubtful = [k for k, line in enumerate(lines) if line.existence < least and line.branch_ends == (None, None)]
    expected = expectations_of([lines[k] for k in doubtful], predicted)
    none = [(1.0 - lines[k].existence) * (1.0 - share) for k, share in zip(doubtful, expected, strict=True)]
    return {k for k, probability in zip(doubtful, none, strict=True) if 1.0 - probability < least}


def _length(line: Centerline) -> int:
    """Return the length, px: points are about 1 px apart."""
    return sum(map(len, line.segments))


def _least(line: Centerline, config: ObjectsConfig) -> float:
    return max(config.min_length_px, config.min_length_widths * line.width_px)
