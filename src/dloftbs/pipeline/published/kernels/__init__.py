"""The compiled loops of published: plain arrays and scalars in and out, nothing checked."""
