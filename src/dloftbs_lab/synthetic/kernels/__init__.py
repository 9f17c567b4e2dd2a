"""The compiled loops of synthetic: plain arrays and scalars in and out, nothing checked."""
