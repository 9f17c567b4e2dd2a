"""The compiled loops of tracking: plain arrays and scalars in and out, nothing checked."""
