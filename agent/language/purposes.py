"""Verbs that a container is named after: "bag the bun" where there is one paper bag, "recycle the can"."""

from __future__ import annotations

from robosandbox.agent.language.match import NOUN_CLASS
from robosandbox.agent.language.slots import HOLDERS, HOLDING, Said
from robosandbox.agent.language.speech import OPENERS
from robosandbox.agent.language.tokens import MARKS, Token, id_parts
from robosandbox.agent.language.wordlist import word_set

_PURPOSES: dict[str, frozenset[str]] = {
    "reject": word_set("reject rejects rejected"),
    "recycle": word_set("recycle recycling recycler"),
    "ship": word_set("ship shipping shipment shipped outbound"),
    "dispatch": word_set("dispatch dispatched outbound"),
    "scrap": word_set("scrap scraps"),
    "trash": word_set("trash"),
    "junk": word_set("junk"),
    "compost": word_set("compost composter"),
    "donate": word_set("donate donation donations"),
    "quarantine": word_set("quarantine"),
    "archive": word_set("archive archives"),
    "bag": word_set("bag"),
    "box": word_set("box"),
    "crate": word_set("crate"),
}
_PLACES = frozenset({"in", "into", "on", "onto", "to"})
_BAGS = frozenset({"bag", "tub", "net", "compost", "outbound", "bucket"})


def where_it_goes(said: Said) -> Said:
    """Return a sentence with "put ... in the paper_bag" for "bag ...", where one container alone is called so."""
    tokens, count = list(said.tokens), len(said.texts)
    if not _PURPOSES.keys() & {*said.texts}:
        return said
    for i in range(count - 2, -1, -1):
        holder = _holder(said, i) if i == 0 or said.texts[i - 1] in OPENERS or said.texts[i - 1] == "not" else None
        if holder is None:
            continue
        start = i + 2 if said.texts[i + 1] == "up" else i + 1
        for end in said.ends("thing", start):
            after = said.texts[end] if end < count else ","
            then = said.texts[end + 1] if after in MARKS and end + 1 < count else ""
            if (after in MARKS or after in ("and", "then", "up")) and then not in _PLACES:
                place = Token("in", "in", "word"), Token(holder, holder, "id")
                put = Token("put", said.tokens[i].raw, "word")
                tokens[i : end + (after == "up")] = [put, *said.tokens[start:end], *place]
                break
    return said.now(tokens)


def _holder(said: Said, i: int) -> str | None:
    """Return the one container whose name tells that it is for what the verb at `i` says."""
    called = _PURPOSES.get(said.texts[i], frozenset())
    named = [(name, id_parts(name)) for name in said.words.ids.values()] if called else []
    fit = [name for name, parts in named if called & {*parts} and _holds(parts[-1])]
    # "the nut to scrap bin" names it.
    return fit[0] if len(fit) == 1 and said.texts[i + 1] not in id_parts(fit[0]) else None


def _holds(head: str) -> bool:
    return head in _BAGS or NOUN_CLASS.get(head) in HOLDING or head.endswith(HOLDERS)
