"""Parts of a curve in space that were inferred, measured once somebody asks for them: in most frames, nobody does."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from dloftbs.data.curve import spans_by_length


class InferredSpans:
    """Base of what has `inferred_3d` by length, made from intervals of the own parameter of its spline in space.

    These stand in ``__dict__`` as ``_fitted_inferred_3d``, beside `curve_3d`.
    """

    if not TYPE_CHECKING:  # where it would vouch for any name

        def __getattr__(self, name: str) -> Any:
            """Measure `inferred_3d` where it is asked for."""
            fitted = self.__dict__.get("_fitted_inferred_3d")
            if name != "inferred_3d" or fitted is None:
                raise AttributeError(f"{type(self).__name__!r} object has no attribute {name!r}")
            spans = self.__dict__[name] = spans_by_length(self.curve_3d, fitted)
            return spans
