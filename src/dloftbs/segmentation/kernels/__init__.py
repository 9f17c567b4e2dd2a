"""The compiled loops of segmentation: plain arrays and scalars in and out, nothing checked."""
