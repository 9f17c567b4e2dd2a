"""The numbers of what an image and depth show across gaps; made by ``python -m benchmarks.fit_evidence``.

docs/maintainers/evidence-weights.md has what the numbers were fitted to, and the results on each source left out.
"""

from __future__ import annotations

import math

import numpy as np

PIXELS = np.array([1.33, -1.98, -1.07])
"""Log-odds that a gap is hidden, and not ground in sight, nats a unit of each column of `describe_pixels`.

Source: fitted; see docs/maintainers/evidence-weights.md.
"""

DEPTHS = np.array([-5.70, -0.47])
"""The same, nats a unit of each column of `describe_depths`.

Source: fitted; see docs/maintainers/evidence-weights.md.
"""

SHARE_IN_SIGHT = 0.62
"""Share of the gaps between ends of two cables that are ground in sight.

Source: fitted; see docs/maintainers/evidence-weights.md.
"""

MAX_SEEN = -math.log(1.0 - SHARE_IN_SIGHT)
"""Most that both say for a joint, nats.

Source: by definition.
"""
