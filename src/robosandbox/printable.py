"""Texts that come from elsewhere, a model's or a perceived one's, as they may be shown."""

import re

_UNPRINTABLE = re.compile(r"[\x00-\x1f\x7f-\x9f\u200e\u200f\u2028-\u202e\u2066-\u2069]+")


def printable(text: str) -> str:
    """Return a text in one line, without signs that move a terminal's cursor, colour it or turn its writing round."""
    return " ".join(_UNPRINTABLE.sub(" ", text).split())
