"""Clauses that may be passed over beside an order, by why: chat, what is said of a thing, a reason.

A clause is passed over only as a whole, from one mark to the next, where it asks for no act and bears no operator: no "not",
"only", "until", "again", and no word that takes something back. Where its subject is somebody, it may say what is not so.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import NamedTuple

from robosandbox.agent.language.ruleset import Ruleset
from robosandbox.agent.language.scene_words import SceneWords
from robosandbox.agent.language.text import ENDS, Classes, is_called, named_in, nearest
from robosandbox.agent.language.vocabulary import EVERYTHING, Hit, Token, Vocabulary

_NAMING = frozenset({"ID", "NAME", "COLOUR", "NUMERAL", "TOWER", "SUPER", "OWN_SIDE", "UP_ORDER", "DOWN_ORDER"})
_HOME = frozenset({"HOME", "GO_HOME"})
_ACTS = frozenset({"GO", "GO_HOME"})
_DESCRIBING = frozenset(
    {"NOUN", "NAME", "ID", "SUFFIX", "COLOUR", "HUE", "SHADE", "SIZE", "SUPER", "ORDINAL", "POS", "SHAPE"}
)
_A_THING = 4  # Words of a description, its article among them; clauses without a verb are longer.
_SEEN = frozenset({"STATE", "THAN", "TABLE"})
_OBJECTS = frozenset({"THE", "A", "ALL", "PRON", "PRONS", "EVERYTHING"})
_IT = frozenset({"it", "them"})
# Subjects that may be the order, or who carries it out, and those that are a thing alone.
_ORDER_SUBJECTS = frozenset({"it", "this", "that", "they", "you"})
_THING_SUBJECTS = frozenset({"it", "they"})
_REPORT_WORDS = 3  # Words of "she told me".
_YOURS = frozenset({"the", "your"})
_DENYING = frozenset({"not", "no", "never", "nobody", "nothing"})


class _Clause(NamedTuple):
    """Properties of a clause: what it names, whether it asks for an act, what it bears."""

    end: int
    named: bool
    nouns: bool
    acts: bool
    bearing: bool
    binding: bool
    always: bool
    denies: bool
    only_denies: bool
    wishing: bool
    seen: bool


def add_chat(found: list[Classes], tokens: Sequence[Token], words: SceneWords, book: Ruleset) -> None:
    """Add to the classes of each token the clauses that begin there and may be passed over.

    CHAT asks for nothing and names nothing that is seen; STATED names something, and somebody is its subject; CHATTER is the
    beginning of a clause up to a thing that it names; TALK is what is said of a thing; SAID is that of "it"; a REMARK may
    follow an order; a REASON follows "because", a
    PURPOSE "so that", an OWN_DOING "and" or "while".
    """
    vocabulary = book.vocabulary
    if "bearing" not in vocabulary.lists:
        return
    parts = frozenset(named_in(words, vocabulary))
    # A slip of a thing's name or of a verb is set right before its clause is passed over.
    unknown = {token.text for token in tokens if token.kind == "word" and token.text not in book.known} - parts
    parts |= {word for word in unknown if (meant := nearest(word, book, words)) in parts or _is_act(meant, vocabulary)}
    for i in range(len(tokens)):
        _add(found, tokens, i, parts, vocabulary)


def _add(found: list[Classes], tokens: Sequence[Token], i: int, parts: frozenset[str], vocabulary: Vocabulary) -> None:
    lists = vocabulary.lists
    opens, tells = _opens(tokens, i, lists["openers"]), tokens[i].text in lists["talk"]
    end = next((k for k in range(i, len(tokens)) if tokens[k].text in ENDS), len(tokens))
    if opens and "UNKNOWN" in found[i] and is_called(tokens, i):
        # "Marta, tap the can" is said to somebody else.
        return
    # "dinner is late so tap the can": the order begins behind it.
    joints = [k for k in range(i + 2, end) if tokens[k].text in lists["joints"]] if opens or tells else []
    for stop in (*joints, end) if end > i else ():
        mark = tokens[stop].text if stop < len(tokens) else ""
        _add_until(found, tokens[:stop], i, parts, vocabulary, opens=opens, tells=tells, whole=stop == end, mark=mark)


def _add_until(
    found: list[Classes],
    tokens: Sequence[Token],
    i: int,
    parts: frozenset[str],
    vocabulary: Vocabulary,
    *,
    opens: bool,
    tells: bool,
    whole: bool,
    mark: str,
) -> None:
    """Add the kinds of clauses that the words from a token to the last one are; `mark` is what stands behind them."""
    lists = vocabulary.lists
    clause = _clause(found, tokens, i, parts, vocabulary, opens=opens, tells=tells)
    if clause is None or clause.always:
        return
    told = [token.text for token in tokens[i : clause.end]]
    if told and told[0] in lists.get("ways", ()):
        # "up a little, down a little"
        return
    if told and told[0] in lists["inverted"]:
        # "should it rain, ...": a condition.
        return
    first = next((word for word in told if word not in lists["openers"]), "")
    first = "" if told[:2] == ["so", "that"] else first
    # "my mother", "I", "nobody": what they do, may and do not is nothing that is asked for.
    somebody = first in lists["persons"] and not clause.binding and not (clause.denies and "you" in told)
    # What they wish is asked for where it names something.
    person = somebody and not (clause.wishing and clause.named)
    own_hand = any("ARM" in found[k] and tokens[k - 1].text in _YOURS for k in range(i + 1, clause.end))
    if first in lists["persons"] and clause.wishing and own_hand:
        # "I want the fingers to point down"
        return
    # "I will count how many you find"
    own = first in ("i", "we") and told[told.index(first) + 1 : told.index(first) + 2] in (["will"], ["am"], ["can"])
    if clause.acts and (not person or clause.named or "us" in told or ("you" in told and not own)):
        # "I will make tea" is what somebody else does.
        return
    thing = opens and clause.nouns and told[0] in lists["determiners"] and len(told) <= _A_THING
    rest = range(i + (told[0] in lists["determiners"]), clause.end)
    if len(rest) > 1 - clause.named and all(not _DESCRIBING.isdisjoint(found[k]) for k in rest):
        # "my thimble", "smallest ball"
        return
    if (thing or not whole) and not person and lists["talk"].isdisjoint(told):
        # "the lid, the can in the bin", "the lid and the can": things that are not seen here, and no clause.
        return

    def add(name: str) -> None:
        found[i].setdefault(name, []).append(Hit(clause.end, None, EVERYTHING))

    obliging = not lists["obliging"].isdisjoint(told) or any(map(_obliges, pairwise(told)))
    adjoined = _is_adjoined(told, first, clause, lists, mark, person=person, behind=i > 0, obliging=obliging)
    if opens and not (clause.named or adjoined) and (person or not (clause.bearing and clause.denies)):
        add("CHAT")
    if opens and clause.named and person and not clause.denies and whole and "so" not in told[1:]:
        add("STATED")
    remark = first in lists["remarks"] and not (clause.bearing or clause.binding)
    # "that was a test" is said of the order, and may take it back.
    remark = remark and not (first in ("this", "that") and "was" in told)
    # "I have a wide beaker coming", but "I need the beaker"
    owns = not clause.nouns or (person and not clause.wishing)
    if opens and not clause.named and not adjoined and (person or remark) and owns and clause.end > i + 1:
        add("REMARK")
    # "so the back row can see it": what others can do then.
    enabling = any(word in lists["able"] and "you" not in told[:k] for k, word in enumerate(told[:_A_THING]) if k)
    if i and clause.end > i + 1 and not clause.named and enabling:
        add("PURPOSE")
    if (
        i
        and clause.end > i + 1
        and not clause.named
        and (person or (first in lists["subjects"] and (clause.only_denies or not clause.bearing) and not adjoined))
    ):
        if person or not clause.bearing:
            add("REASON")
        owned = first in lists["owners"] and clause.nouns
        if person or owned or (clause.denies and first in ("it", "they")):
            # "so that they look pretty" would be asked for; "so it does not fall" is not.
            add("PURPOSE")
    if i and person and not clause.named and clause.end > i + 1 and _IT.isdisjoint(told):
        add("OWN_DOING")
    if tells and not (clause.bearing or clause.seen or obliging):
        # What can be seen of it has to be so, and is no talk.
        add("TALK")
        if not (clause.named or clause.nouns):
            add("SAID")


def _is_adjoined(
    told: Sequence[str],
    first: str,
    clause: _Clause,
    lists: Mapping[str, frozenset[str]],
    mark: str,
    *,
    person: bool,
    behind: bool,
    obliging: bool,
) -> bool:
    """Say whether a clause tells when, how or on what condition something is to be done, or takes it back.

    Args:
        told: Its words.
        first: The first of them that does not only open it.
        clause: Its properties.
        lists: Those of the language.
        mark: What stands behind it.
        person: Somebody is its subject.
        behind: It does not begin the sentence.
        obliging: It has a word of what must be.
    """
    own = told[0] == "while" and len(told) > 1 and told[1] in lists["persons"] and _IT.isdisjoint(told)
    second = told[1] if len(told) > 1 else ""
    return (
        # "after lunch", "or I will", "while I hold it"
        (not own and not lists["adjoining"].isdisjoint((told[0], first)))
        # "the moment the kettle boils"
        or (told[0] == "the" and second in lists["moments"])
        # "the middle one first"
        or (not person and told[-1] in ("first", "last", "tomorrow", "tonight", "later"))
        # "it has to be done in silence", "do it blindfolded"
        or (first in _ORDER_SUBJECTS and obliging)
        or (first == "do" and not clause.denies)
        # "..., she told me", "..., I don't want that", "..., I don't think so"
        or (behind and len(told) <= _REPORT_WORDS and second in lists["reporting"])
        or (behind and clause.denies and clause.wishing and told[-1] in ("that", "this", "it"))
        or (clause.denies and told[-1] == "so")
        # "backwards: ..."; "here is the thing: ...", "second try of the day: ..." tell nothing of it.
        or (first not in lists["subjects"] and mark == ":" and (len(told) == 1 or clause.bearing or clause.binding))
        or told[0] in ("rather", "instead")
    )


def _obliges(pair: tuple[str, str]) -> bool:
    return pair[0] in ("has", "have", "need", "needs") and pair[1] == "to"


def _is_act(word: str | None, vocabulary: Vocabulary) -> bool:
    verbs = (name for name in vocabulary.classes if name[0] == "V" and name != "VCANNOT")
    return word is not None and any(vocabulary.is_form(word, name) for name in verbs)


def _opens(tokens: Sequence[Token], i: int, openers: frozenset[str]) -> bool:
    """Say whether a clause begins at a token: at a mark, or behind "and", "so", "well" at one."""
    while i and tokens[i - 1].text in openers:
        i -= 1
    return i == 0 or tokens[i - 1].text in ENDS or tokens[i - 1].text == "er"


def _clause(
    found: list[Classes],
    tokens: Sequence[Token],
    i: int,
    parts: frozenset[str],
    vocabulary: Vocabulary,
    *,
    opens: bool,
    tells: bool,
) -> _Clause | None:
    """Return what a clause from a token to the next mark is; add where its beginning may be passed over up to a thing."""
    lists, acting = vocabulary.lists, vocabulary.mask("base ing")
    end, named, bearing, binding, nouns, acts, denies = i, False, False, False, False, False, False
    base = vocabulary.mask("base")
    always, counts, wishing, counted, seen, bears = False, False, False, False, False, False
    stops: list[int] = []
    barred = tokens[i].text in lists["barring"]
    opening = next((token.text for token in tokens[i:] if token.text not in lists["openers"]), "")
    somebody = opening in lists["persons"]
    while end < len(tokens) and tokens[end].text not in ENDS:
        here, word = found[end], tokens[end].text
        if tokens[end].kind == "mark":
            return None
        always |= word in lists["always"]
        # "there is dust on it" points nowhere.
        expletive = word == "there" and end == i
        bearing |= (
            word in lists["bearing"] and not expletive and not (tells and (end == i or word in lists["harmless"]))
        )
        # "my back hurts"
        binding |= word in lists["binding"] and not (
            word == "back" and end and tokens[end - 1].text in lists["persons"]
        )
        # "she would like it shut"
        binding |= wishing and any(name[0] == "V" and name != "VCANNOT" for name in here)
        wishing |= word in lists["wishing"]
        denies |= word in _DENYING
        bears |= word in lists["bearing"] and word not in _DENYING
        # "it does not get lost" forbids nothing.
        cued = (
            end > i
            and tokens[end - 1].text in lists["cues"]
            and not (tokens[end - 1].text == "not" and opening in _THING_SUBJECTS)
        )
        if not tells and ((end == i and opens) or cued):
            begins = (end == i and not i) or (end > i and tokens[end - 1].text in ("you", "then"))
            names = (n for n in here if n in _ACTS or (n[0] == "V" and (begins or n != "VCANNOT")))
            acts |= any(hit.mask & acting for name in names for hit in here[name])
        if not tells and end > i and tokens[end - 1].text not in lists["persons"] and end + 1 < len(tokens):
            # A verb with its object is an order, wherever it stands.
            verbs = (name for name in here if name[0] == "V" and name != "VCANNOT")
            acts |= not _OBJECTS.isdisjoint(found[end + 1]) and any(hit.mask & base for n in verbs for hit in here[n])
        # "I can not sleep", where there is a can.
        modal = "MODAL" in here and end > i and tokens[end - 1].text in lists["persons"]
        nouns |= "NOUN" in here and not modal
        counts |= any(hit.value != 1 for hit in here.get("NUMBER", ())) or not _HOME.isdisjoint(here)
        named |= (not _NAMING.isdisjoint(here) or word in parts) and not modal
        seen |= (named and "CLAIM" not in here) or not _SEEN.isdisjoint(here)
        end += 1
        counted |= word in lists["determiners"] and word not in lists["owners"]
        if opens and not (
            named or nouns or barred or (bearing and not somebody) or denies or acts or always or counted
        ):
            stops.append(end)
    # "two high", "back to your position": chat only where somebody states it.
    first = next((t.text for t in tokens[i:end] if t.text not in lists["openers"]), "")
    named |= counts and first not in lists["subjects"]
    if stops and not tells:
        found[i]["CHATTER"] = [Hit(stop, None, EVERYTHING) for stop in stops]
    return (
        _Clause(end, named, nouns, acts, bearing, binding, always, denies, denies and not bears, wishing, seen)
        if end > i
        else None
    )
