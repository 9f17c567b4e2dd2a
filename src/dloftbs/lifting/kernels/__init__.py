"""The compiled loops of lifting: plain arrays and scalars in and out, nothing checked."""
