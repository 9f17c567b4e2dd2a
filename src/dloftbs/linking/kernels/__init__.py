"""The compiled loops of linking: plain arrays and scalars in and out, nothing checked."""
