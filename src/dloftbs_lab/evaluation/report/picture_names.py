"""Names of the files of pictures."""

import re


def stem_of(*parts: str) -> str:
    """Return a name without a suffix, made of what a picture shows; a dash stands for signs that are no letters."""
    return re.sub(r"[^\w.]+", "-", "-".join(filter(None, parts)))
