"""Clauses that may be passed over beside an order, by why: chat, what is said of a thing, a reason.

A clause is passed over only as a whole, from one mark to the next, where it asks for no act, names nothing that is seen and
bears no operator: no "not", "only", "until", "again", and no word that takes something back.
"""

from __future__ import annotations

from collections.abc import Sequence

from robosandbox.agent.language.text import ENDS, Classes, named_in
from robosandbox.agent.language.tokens import SceneWords
from robosandbox.agent.language.vocabulary import EVERYTHING, Hit, Token, Vocabulary

_NAMING = frozenset({"ID", "NAME", "COLOUR", "NUMERAL", "TOWER"})
_DENYING = frozenset({"not", "no", "never"})


def add_chat(found: list[Classes], tokens: Sequence[Token], words: SceneWords, vocabulary: Vocabulary) -> None:
    """Add to the classes of each token the clauses that begin there and may be passed over.

    CHAT asks for nothing and names nothing that is seen; CHATTER is the beginning of a clause up to a thing that it names;
    TALK is what is said of a thing; SAID is that of "it"; a REMARK may follow an order; a REASON follows "because".
    """
    if "bearing" not in vocabulary.lists:
        return
    named = named_in(words, vocabulary)
    for i in range(len(tokens)):
        _add(found, tokens, i, frozenset(named), vocabulary)


def _add(found: list[Classes], tokens: Sequence[Token], i: int, parts: frozenset[str], vocabulary: Vocabulary) -> None:
    lists = vocabulary.lists
    before = tokens[i - 1].text if i else ","
    opens, tells = before in ENDS, tokens[i].text in lists["talk"]
    end, named, bearing, nouns, barred = i, False, False, False, False
    stops: list[int] = []
    acting = vocabulary.mask("base ing")
    while end < len(tokens) and tokens[end].text not in ENDS:
        here, word = found[end], tokens[end].text
        if word in lists["always"] or tokens[end].kind == "mark":
            return
        bearing |= word in lists["bearing"] and not (tells and (end == i or word in lists["harmless"]))
        cued = end > i and tokens[end - 1].text in lists["cues"]
        if not tells and ((end == i and opens) or cued):
            opening = (end == i and not i) or tokens[end - 1].text in ("you", "then")
            acts = (name for name in here if name[0] == "V" and (opening or name != "VCANNOT"))
            if any(hit.mask & acting for name in acts for hit in here[name]):
                return
        nouns |= "NOUN" in here
        seen = not _NAMING.isdisjoint(here) or word in parts
        named |= seen
        barred |= word in _DENYING or (end == i and word in lists["barring"])
        end += 1
        if opens and not named and not nouns and not barred:
            stops.append(end)
    if stops:
        found[i]["CHATTER"] = [Hit(stop, None, EVERYTHING) for stop in stops]
    if end == i:
        return
    hit = [Hit(end, None, EVERYTHING)]
    remark = tokens[i].text in lists["remarks"]
    denies = not _DENYING.isdisjoint(token.text for token in tokens[i:end])
    if opens and not named and not (bearing and denies and not remark):
        found[i]["CHAT"] = hit
    if bearing:
        return
    if opens and not named and remark and not nouns:
        found[i]["REMARK"] = hit
    if tells:
        found[i]["TALK"] = hit
        if not (named or nouns):
            found[i]["SAID"] = hit
    if i and not named:
        found[i]["REASON"] = hit
