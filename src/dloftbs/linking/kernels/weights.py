"""The weights of the columns of `joint_features`, nats a unit; made by ``python -m benchmarks.fit_linking weights``.

docs/linking-weights.md has what they were fitted to, and the results on each source left out.
"""

from __future__ import annotations

import numpy as np

JOINT = np.array([
    8.94,  # LINK_TURN
    3.59,  # LINK_SWERVE
    21.99,  # GAP_ENERGY
    0.24,  # GAP_LENGTH
    1.70,  # GAP_ROUND
    14.45,  # GAP_GROUND
    -0.29,  # GAP_HIDDEN
    5.86,  # DEPTH_SWERVE
])  # fmt: skip
"""What each column of a joint costs.

Source: fitted; see docs/linking-weights.md.
"""

OPEN = np.array([
    4.02,  # OPEN_JUNCTION
    8.70,  # OPEN_KINK
    2.72,  # OPEN_FREE
])  # fmt: skip
"""What each column of an end that stays open costs.

Source: fitted; see docs/linking-weights.md.
"""
