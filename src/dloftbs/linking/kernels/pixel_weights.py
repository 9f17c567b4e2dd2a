"""The numbers of what an image shows across gaps; made by ``python -m benchmarks.fit_pixels``.

docs/maintainers/pixel-weights.md has what the numbers were fitted to, and the results on each source left out.
"""

from __future__ import annotations

import math

import numpy as np

PIXELS = np.array([1.32, -1.99, -1.07])
"""Log-odds that a gap is hidden, and not ground in sight, nats a unit of each column of `describe_pixels`.

Source: fitted; see docs/maintainers/pixel-weights.md.
"""

SHARE_IN_SIGHT = 0.69
"""Share of the gaps between ends of two cables that are ground in sight.

Source: fitted; see docs/maintainers/pixel-weights.md.
"""

MAX_SEEN = -math.log(1.0 - SHARE_IN_SIGHT)
"""Most that an image says for a joint, nats.

Source: by definition.
"""
