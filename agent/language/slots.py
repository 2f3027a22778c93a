"""Slots of a template: the phrases that the grammar reads in a sentence, by kind."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import cached_property

from robosandbox.agent.language.grammar import Grammar
from robosandbox.agent.language.intent import Ref, Relation
from robosandbox.agent.language.match import NOUN_CLASS
from robosandbox.agent.language.modifiers import SHAPED
from robosandbox.agent.language.speech import CONDITIONS, GRAMMAR_WORDS, QUESTIONS
from robosandbox.agent.language.tokens import MARKS, SceneWords, Token, id_parts
from robosandbox.agent.language.verbs import UNSUPPORTED_VERBS
from robosandbox.agent.language.wordlist import word_set

_MOST_WORDS = 14  # Number of words of a name. Chosen.


@dataclass
class Said:
    """The tokens of one sentence, and the phrases that the grammar reads in them once they are asked for."""

    tokens: Sequence[Token]
    words: SceneWords
    texts: list[str] = field(init=False)

    def __post_init__(self) -> None:
        self.texts = [token.text for token in self.tokens]

    def now(self, tokens: Sequence[Token]) -> Said:
        """Return a sentence of these tokens: this one, with the phrases read in it so far, if they are the same."""
        return self if tuple(tokens) == tuple(self.tokens) else Said(tuple(tokens), self.words)

    @cached_property
    def grammar(self) -> Grammar:
        """The chart of the sentence."""
        return Grammar(self.tokens, self.words)

    def ends(self, kind: str, i: int) -> list[int]:
        """Return where phrases of a kind end that start at token `i`, the longest first."""
        tag, _, value = kind.partition("=")
        if tag.isupper():
            return [end for end, found in self.grammar.tag(i, tag) if not value or found == value]
        return [end for end in KINDS[kind](self, i) if end > i]


def _known(refs: Sequence[Ref]) -> bool:
    return not any(ref.unknown for ref in refs)


def _single(ref: Ref) -> bool:
    return not (ref.plural or ref.unknown or ref.number or ref.determiner in ("all", "it"))


def _longest(ends: list[int]) -> list[int]:
    return sorted(set(ends), reverse=True)


def _things(said: Said, i: int) -> list[int]:
    return _longest(
        [end for end, refs in said.grammar.np_list(i) if _known(refs) and (len(refs) == 1 or _listed(refs))]
    )


def _listed(refs: Sequence[Ref]) -> bool:
    """Say whether several things are plainly listed: not "the apple, that ...", nor "cube in the box and the can ..."."""
    return not any(
        # "the cube, close drawer" goes on with an order.
        ref.relations or (k and (ref.determiner == "it" or ref.text.startswith("close ")))
        for k, ref in enumerate(refs)
    )


def _one(said: Said, i: int) -> list[int]:
    return _longest([end for end, ref in said.grammar.np(i) if _single(ref)])


def _that(said: Said, i: int) -> list[int]:
    # "the lemon back" is no lemon-coloured one.
    refs = [(end, ref) for end, ref in said.grammar.np(i) if _single(ref) and ref.determiner == "the"]
    return _longest([end for end, ref in refs if ref.nouns or ref.names or said.texts[end - 1] == "one"])


def _many(said: Said, i: int) -> list[int]:
    return _longest(
        [end for end, ref in said.grammar.np(i) if ref.plural and _known((ref,)) and ref.determiner != "it"]
    )


def _of_class(*classes: str) -> Callable[[Said, int], list[int]]:
    def ends(said: Said, i: int) -> list[int]:
        return _longest(
            [
                end
                for end, ref in said.grammar.np(i)
                if not ref.unknown
                and (
                    {NOUN_CLASS.get(noun) for noun in ref.nouns} & {*classes}
                    or {NOUN_CLASS.get(part) for name in ref.names for part in id_parts(name)} & {*classes}
                )
            ]
        )

    return ends


def _holders(said: Said, i: int) -> list[int]:
    """What by its noun, or by the name of the only thing it can be, others go into: "the laundry" for a laundry bin."""
    ends = KINDS["container"](said, i)
    start = i + 1 if said.texts[i] in ("the", "that", "this", "our", "my") else i
    for end in range(start + 1, min(len(said.texts), start + 3) + 1):
        spoken = {*said.texts[start:end]}
        named = [id_parts(name) for name in said.words.ids if spoken <= {*id_parts(name)}]
        if len(named) == 1 and (NOUN_CLASS.get(named[0][-1]) in HOLDING or named[0][-1].endswith(HOLDERS)):
            ends.append(end)
    return _longest(ends)


def _adjectives(said: Said, i: int) -> list[int]:
    tags = ("COLOUR", "SHADE", "SIZE", "SUPER", "POS")
    return (
        [i + 1] if said.texts[i] in SHAPED else _longest([end for tag in tags for end, _ in said.grammar.tag(i, tag)])
    )


def _places(said: Said, i: int) -> list[int]:
    return _longest([end for end, element in said.grammar.element(i) if element.kind in ("place", "matching")])


def _distances(said: Said, i: int) -> list[int]:
    return _longest([end for end, _ in said.grammar.distance(i)])


def _ways(said: Said, i: int) -> list[int]:
    return _longest(
        [
            end
            for end, element in said.grammar.element(i)
            if element.kind in ("direction", "distance")
            or (element.kind == "place" and isinstance(element.value, Relation) and element.value.kind in _TOWARDS)
        ]
    )


def _doing(said: Said, i: int) -> list[int]:
    return [end for end, _ in said.grammar.tag(i, "VERB") if said.texts[i].endswith("ing")]


def _nouns(said: Said, i: int) -> list[int]:
    return _longest([end for end, (_, _, plural) in said.grammar.tag(i, "NOUN") if plural])


def _bare(said: Said, i: int) -> list[int]:
    """As in "no vials", "no red cubes": several things of a kind, and where they are is no part of it."""
    refs = [(end, ref) for end, ref in said.grammar.np(i) if ref.determiner == "bare" and ref.plural]
    return _longest([end for end, ref in refs if _known((ref,)) and not ref.relations])


def _person(said: Said, i: int) -> list[int]:
    return [i + 1] if said.texts[i] in PEOPLE else []


def _name(said: Said, i: int) -> list[int]:
    """A word that nobody knows, as people's names are."""
    token = said.tokens[i]
    known = said.grammar.tags[i] or token.text in said.words.parts or token.text in _KNOWN
    return [i + 1] if token.kind == "word" and not known else []


def _clause_words(said: Said, i: int) -> list[int]:
    """Any words up to the next mark, as few as will do."""
    ends = []
    for end in range(i + 1, min(len(said.texts), i + _MOST_WORDS) + 1):
        if said.texts[end - 1] in MARKS:
            break
        ends.append(end)
    return ends


def _all_words(said: Said, i: int) -> list[int]:
    return list(range(i + 1, len(said.texts) + 1))


def _run_of(words: frozenset[str]) -> Callable[[Said, int], list[int]]:
    def ends(said: Said, i: int) -> list[int]:
        end = i
        while end < len(said.texts) and said.texts[end] in words:
            end += 1
        return list(range(end, i, -1))

    return ends


_PRAISE = word_set(
    """
    be been really so very ever much just mean a lot make me us my day help it do like love appreciate great good nice lovely kind
    super helpful handy happy glad grateful thankful delighted obliged indebted pleased thrilled awfully terribly most extremely of you fantastic wonderful
    over moon chuffed tickled happier better easier nicer relieved sleep rest feel prefer rather more comfortable
    brilliant big huge world the to sweet enough as and
    """
)
PEOPLE = word_set(
    """
    daughter son wife husband mommy mummy daddy granny nan grandad mum mom mother dad father boss friend kid kids child children baby teacher customer guest chef
    doctor professor colleague partner girlfriend boyfriend brother sister neighbour neighbor client manager supervisor nurse
    cook cat dog kitty kitten doggy doggie puppy bunny grandma grandpa roommate flatmate team family student patient waiter barista bartender lab lady man woman
    """
)
_KNOWN = GRAMMAR_WORDS | QUESTIONS | CONDITIONS | UNSUPPORTED_VERBS | word_set("i we he she they who someone somebody")
HOLDING = frozenset({"bin", "bowl", "box", "drawer"})
HOLDERS = ("box", "bin", "tray", "basket", "rack", "hamper", "crate", "bucket")
_TOWARDS = frozenset({"towards", "away", "against"})
KINDS: dict[str, Callable[[Said, int], list[int]]] = {
    "thing": _things,
    "one": _one,
    "that": _that,
    "many": _many,
    "ball": _of_class("ball"),
    "drawer": _of_class("drawer"),
    "container": _of_class("bin", "bowl", "box", "drawer"),
    "holder": _holders,
    "adjective": _adjectives,
    "nouns": _nouns,
    "bare": _bare,
    "place": _places,
    "distance": _distances,
    "way": _ways,
    "praise": _run_of(_PRAISE),
    "person": _person,
    "doing": _doing,
    "name": _name,
    "word": lambda said, i: [i + 1],
    "words": _clause_words,
    "text": _all_words,
}
"""What a slot takes: `thing` one or several things, `name` a word that nobody knows, `one` a single one, `that` a definite one, `many` a plural, `nouns` a noun in the plural, `words` any
words of a clause, `text` anything, `doing` a verb in -ing."""
