"""The weights of the columns of `joint_features`, nats a unit; made by ``python -m benchmarks.fit_linking weights``.

docs/maintainers/linking-weights.md has what they were fitted to, and the results on each source left out.
"""

from __future__ import annotations

import numpy as np

JOINT = np.array([
    8.92,  # LINK_TURN
    3.92,  # LINK_SWERVE
    22.71,  # GAP_ENERGY
    0.26,  # GAP_LENGTH
    1.90,  # GAP_ROUND
    0.97,  # DEPTH_SWERVE
    7.30,  # OTHER_COLOUR
    -1.00,  # GAP_SEEN
])  # fmt: skip
"""Cost of each column of a joint, nats a unit.

Source: fitted, `OTHER_COLOUR` counted, `GAP_SEEN` by definition; see docs/maintainers/linking-weights.md.
"""

OPEN = np.array([
    4.17,  # OPEN_JUNCTION
    9.29,  # OPEN_KINK
    2.88,  # OPEN_FREE
])  # fmt: skip
"""Cost of each column of an end that stays open, nats a unit.

Source: fitted; see docs/maintainers/linking-weights.md.
"""
