"""The commands ``dloftbs demo`` and ``dloftbs evaluate``."""

import dloftbs.cli  # noqa: F401 - first, since it loads these commands, which import parts of it
