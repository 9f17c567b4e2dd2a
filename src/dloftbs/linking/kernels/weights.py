"""The weights of the columns of `joint_features`, nats a unit; made by ``python -m benchmarks.fit_linking weights``.

docs/linking-weights.md has what they were fitted to, and the results on each source left out.
"""

from __future__ import annotations

import numpy as np

JOINT = np.array([
    9.32,  # LINK_TURN
    3.66,  # LINK_SWERVE
    22.01,  # GAP_ENERGY
    0.25,  # GAP_LENGTH
    1.78,  # GAP_ROUND
    17.66,  # GAP_GROUND
    -0.21,  # GAP_HIDDEN
    11.11,  # DEPTH_SWERVE
])  # fmt: skip
"""Cost of each column of a joint, nats a unit.

Source: fitted; see docs/linking-weights.md.
"""

OPEN = np.array([
    4.13,  # OPEN_JUNCTION
    8.87,  # OPEN_KINK
    2.79,  # OPEN_FREE
])  # fmt: skip
"""Cost of each column of an end that stays open, nats a unit.

Source: fitted; see docs/linking-weights.md.
"""
