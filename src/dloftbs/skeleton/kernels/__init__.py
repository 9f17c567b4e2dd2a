"""The compiled loops of skeleton: plain arrays and scalars in and out, nothing checked."""
