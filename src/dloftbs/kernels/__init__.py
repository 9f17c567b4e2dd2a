"""The compiled loops: plain arrays and scalars in and out, nothing checked."""
