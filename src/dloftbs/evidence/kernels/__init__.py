"""The compiled loops of evidence: plain arrays and scalars in and out, nothing checked."""
