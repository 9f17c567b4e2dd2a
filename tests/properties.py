"""Properties that take long have a fifth of the examples of others, in the suite and in ``make fuzz`` alike."""

from __future__ import annotations

from hypothesis import settings

few_examples = settings(max_examples=settings.default.max_examples // 5)
