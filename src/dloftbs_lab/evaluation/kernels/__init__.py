"""The compiled loops of evaluation: plain arrays and scalars in and out, nothing checked."""
