"""The compiled loops of crossings: plain arrays and scalars in and out, nothing checked."""
