"""The commands ``dloftbs demo`` and ``dloftbs evaluate``."""
