"""The compiled loops of camera: plain arrays and scalars in and out, nothing checked."""
