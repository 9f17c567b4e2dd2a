"""The compiled loops of cleaning: plain arrays and scalars in and out, nothing checked."""
