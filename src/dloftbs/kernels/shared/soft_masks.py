"""Limits of masks that are probabilities, and the places where they are asked."""

from __future__ import annotations

HALF = 128
"""Least value of what is rather cable than not, of 256.

Source: by definition.
"""

LEAST_PROBABLE = HALF // 8
"""Least value that shows cable at all, of 256.

Source: by definition; a sixteenth: below, 8 bits hold little but noise.
"""

AHEAD_WIDTHS = (1.0, 1.25, 1.5)
"""Distances ahead of an end that are looked at, widths.

Source: by hand; beyond the soft border of the end itself, and no farther than most gaps of networks' masks.
"""

ASIDE_WIDTHS = (-0.4, -0.2, 0.0, 0.2, 0.4)
"""Distances to the sides of a place ahead of an end, or in a gap, where the cable may be, widths.

Source: geometry; the pixels of a cable that lies there.
"""
