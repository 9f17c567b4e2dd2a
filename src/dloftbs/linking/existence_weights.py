"""The existence of objects; made by ``python -m benchmarks.fit_linking existence``.

docs/maintainers/linking-existence.md has what they were fitted to, and the results on each source left out.
"""

from __future__ import annotations

SIZE = (8.10, 2.69)
"""Log-odds that an object is a cable: one as large as the largest, and per unit of the logarithm of its share.

Source: fitted; see docs/maintainers/linking-existence.md.
"""
