"""The compiled loops of fitting: plain arrays and scalars in and out, nothing checked."""
