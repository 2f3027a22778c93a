"""Word lists as text."""


def word_set(text: str) -> frozenset[str]:
    """Return the words of a text."""
    return frozenset(text.split())


def phrase_list(text: str) -> list[str]:
    """Return the phrases that commas separate."""
    return [phrase for part in text.split(",") if (phrase := part.strip())]
