"""A sentence clause by clause: where clauses begin, what they are about, what stands for a thing or an act in them, what may bind an order."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import NamedTuple

from robosandbox.agent.language.lexicon import LEXICON, words_plural
from robosandbox.agent.language.slots import PEOPLE, Said
from robosandbox.agent.language.speech import GRAMMAR_WORDS, QUESTIONS
from robosandbox.agent.language.tokens import MARKS, Token
from robosandbox.agent.language.verbs import BASE_FORMS
from robosandbox.agent.language.wordlist import word_set

_WHOLE = frozenset({"ALL", "EVERYTHING", "BOTH", "OTHER", "OTHERS", "REST"})
_ANY = frozenset({"one", "thing"})


def may_spare(said: Said, left: Sequence[Token]) -> bool:
    """Tell whether what a sentence says beside its order names one of several things that the order is for.

    As in "the red block is mine, put the blocks in the bin": nobody can tell whether that goes too.

    Args:
        said: The sentence.
        left: What of it is the order; the same tokens.
    """
    kept = {id(token) for token in left}
    beside = [token for token in said.tokens if id(token) not in kept]
    told = _kinds(beside, said)
    if not told or not beside:
        return False
    tags = [{tag for _, tag, _ in LEXICON.at(left, i)} for i in range(len(left))]
    if any(_WHOLE & found for found in tags):
        return True
    several = {kind for kind, plural in _nouns(left, said) if plural} - {
        kind for kind, plural in _nouns(beside, said) if plural
    }
    return bool(several) and bool((told & several) | (told & _ANY) | (several & _ANY))


def _kinds(tokens: Sequence[Token], said: Said) -> set[str]:
    """Return what kinds of things words name; a colour alone may be of any."""
    kinds = {kind for kind, _ in _nouns(tokens, said)}
    coloured = any(tag == "COLOUR" for i in range(len(tokens)) for _, tag, _ in LEXICON.at(tokens, i))
    return kinds or ({"one"} if coloured else set())


def _nouns(tokens: Sequence[Token], said: Said) -> set[tuple[str, bool]]:
    """Return the kinds of things that words name, each with whether it is several; words of ids are kinds of their own."""
    found: set[tuple[str, bool]] = set()
    plurals = {words_plural(part): part for part in said.words.parts if part.isalpha() and len(part) > 2}
    for i, token in enumerate(tokens):
        tags = {tag for _, tag, _ in LEXICON.at(tokens, i)}
        nouns = [value for _, tag, value in LEXICON.at(tokens, i) if tag == "NOUN"]
        found |= {(noun, plural) for noun, _, plural in nouns}
        if token.text in plurals and token.text not in said.words.parts:
            found.add((plurals[token.text], True))
        elif token.text in said.words.parts and not nouns and not tags - {"ABSENT"}:
            found.add((token.text, False))
        if token.kind == "id":
            found |= {(part, False) for part in token.text.split("_") if part.isalpha()}
    return found


BINDING = word_set(
    """
    if unless assuming provided providing supposing until till whether otherwise else instead except only again maybe perhaps nor neither without
    cancel abort joking kidding joke wrong mistake mistaken meant mean or mind changed
    pretend pretending hypothetically fictional imaginary
    nobody nothing none careful avoid beware allowed forbidden upright upside sideways rather twice
    """
)
"""What may forbid, limit, put off or take back an order, wherever it stands."""
TAKEN_BACK = word_set(
    "thought decided question against postponed cancelled canceled cancel abort joking kidding joke wrong mistake mistaken meant mean mind changed forget already done finished enough"
)
"""What may take an order back: only one that was given."""
HELD_OFF = word_set("only until unless yet later tomorrow tonight rather before")
"""What may limit or put off an order even where a reason is told."""
FRAMES = frozenset(
    f"{one} {other}"
    for modal in ("could", "can", "would", "will", "might", "may")
    for one, other in (("you", modal), (modal, "you"))
) | {"if you", "as to"}
"""After which the order comes: "I was hoping that you might ..."."""
COURTEOUS = word_set(
    """
    i we you it that this is would could can will might may be am if as to ask let me do any have had a an the was were
    been ever so really very much super just terribly awfully most extremely kindly possibly perhaps please
    good nice great lovely kind helpful cool fantastic wonderful brilliant sweet perfect glad happy grateful obliged thankful delighted
    appreciate appreciated love like hope hoping wonder wondering think guess reckon suppose chance mind able possible
    favour favor help thing for of
    """
)
"""Of what a frame around an order is made."""
PUT_OFF = word_set("stop wait forget already done finished enough later tomorrow tonight not never no")
"""What may do so but where it is told of somebody: "I can not see", "she comes later"."""
HELD_BACK = word_set(
    "yet now ready sure want wants mean think like ask say said tell told so longer done finished it that this them those one ones "
    "myself ourselves himself herself please way allowed need needs"
)
"""With which a "not" of somebody's may be about the order: "I do not think so", "I am not ready yet"."""
TIMED = word_set("when whenever once after then first last next")
"""How clauses begin that say when."""
JOINTS = word_set("and but so because cause since before while as though although which who")
LEADS = word_set(
    "and but so because cause since before while as though although well oh also anyway now ok okay that hey yeah yes right just yesterday today"
)
REASONS = word_set("because cause since as so though although")
PERSONS = (
    word_set(
        "i we he she you everyone everybody someone somebody people mommy nobody mom mum dad guests visitors customers boss"
    )
    | PEOPLE
)
WHOSE = word_set("my our his her their your")
ARTICLES = WHOSE | word_set("the a an")
DETERMINERS = WHOSE | word_set("the a an some that this these those one")
REFERRING = word_set("it this that they there these those things")
OBJECTS = word_set("it them that this those these one ones")
AUXILIARIES = word_set(
    "is are was were am has have had will would can could does did do may might shall should must be been"
)
PAST = word_set(
    """
    was were had did came went got made took told fell broke ran kept found lost spent heard built bought thought felt said
    hurt gave saw knew sent brought dug sat stood held slept rang ate drank wore drove flew began met paid left read bet
    grew woke forgot hit cost won sang wrote burnt
    """
)
FINITE = (
    AUXILIARIES
    | (PAST - {"left", "read", "bet"})
    | word_set(
        "thinks loves hates knows says say needs wants looks seems feels smells sounds gets goes keeps makes takes comes hurts"
    )
)
ASKING = word_set(
    "want wants need needs wish wishes like likes prefer prefers love expect wanted needed asked asks say says said tell told"
)
MODALS = word_set("should must may can could shall might ought would")
PLACING = word_set("goes gets needs wants keeps takes comes")
BEING = word_set("is are was were be been looks look getting so very too")
ADDRESSING = word_set(
    "mind worry ask show prove remember smile judge laugh look see listen hear guess imagine think feel have be help thank bless believe trust know say"
)
"""Verbs with which a speaker turns to somebody: no order while no thing is named."""
GREETINGS = word_set("sorry thanks thank cheers hello hi welcome congratulations apologies excuse pardon bravo")
GENERIC = word_set("thing things one guy piece stuff")
"""Nouns that name a thing of the scene only with a word that describes it."""
CONDITIONAL = word_set(
    "if unless assuming provided providing supposing until till when whenever once while whether before after"
)
JOKING = word_set(
    """
    joking kidding joke pretend pretending hypothetically fictional imaginary opposite example following wrong suppose supposing imagine
    dream dreamed dreamt prohibited banned illegal nobody nothing none everything anything careful avoid beware allowed forbidden
    maybe perhaps otherwise else instead except cancel abort cancelled canceled postponed
    """
)
"""Words of a clause that may forbid, limit or take back an order that follows, whoever says so."""
LIMITING = word_set(
    "only again rather twice wait stop later tomorrow tonight upright upside sideways without neither nor yet"
)
NEGATIVE = word_set("not no never")
PURPOSES = word_set("for to")
REPORTING = word_set(
    "says said say saying asks asked shouts shouted cried called writes wrote reads whispered answered replied reports"
)
"""Verbs with which a clause ends whose words the next one quotes."""
OF_LANGUAGE = word_set(
    "say read spell translate repeat type typed write wrote copy pronounce hear heard print quote mean means would"
)
"""With which "this" may be the order that follows, as words."""
ACCIDENTS = word_set("roll fall get slip break spill drop tip vanish disappear")
"""What a thing does that nobody asks for: "so it does not roll away"."""
PUTTING_OFF = word_set("wait stop later tomorrow tonight yet")
WILLING = word_set(
    "mind kind good nice able possible convenient minute moment second time chance ready ok okay alright right fine trouble"
)
POLITE = WILLING | word_set(
    "if when whenever you it that is would be are were can could so sweet lovely not too much of to a an the for up all me have "
    "get got find please no bother problem at as do with"
)
LABELS = word_set("task job thing deal plan request mission order command goal instruction")
ORDERED = frozenset({"ORDINAL", "FIRST", "THEN", "SUPER"})
NO_MATTER = word_set("rush hurry pressure worries worry problem stress trouble fuss")


_OF_SAYING = frozenset({"so", "to", "saying", "asking", "having", "said", "asked"})


class Clause(NamedTuple):
    """Tokens from `start` up to `end`, and where the next clause begins.

    Attributes:
        opens: It begins a sentence.
        closes: It ends one.
    """

    start: int
    end: int
    after: int
    opens: bool
    closes: bool


class Clausewise:
    """One sentence, clause by clause."""

    def __init__(self, said: Said) -> None:
        self.said = said
        self.tokens: tuple[Token, ...] = tuple(said.tokens)
        self.texts: list[str] = said.texts
        self.tags: list[set[str]] = [{tag for _, tag, _ in LEXICON.at(self.tokens, i)} for i in range(len(self.tokens))]

    def _clauses(self) -> Iterator[Clause]:
        i, n, opens = 0, len(self.texts), True
        while i < n:
            end = i
            while end < n and self.texts[end] not in MARKS and not (end > i and self._begins(end)):
                end += 1
            after = end
            while after < n and self.texts[after] in MARKS:
                after += 1
            closes = after == n or bool({".", "!", "?", ";"} & {*self.texts[end:after]})
            yield Clause(i, end, after, opens, closes)
            i, opens = after, closes

    def _begins(self, k: int) -> bool:
        """Say whether a clause begins with the joint at `k`: "and she hates onions", "so I can reach it"."""
        text = self._text(k)
        if text not in JOINTS or (text == "as" and self._text(k - 2) == "as"):
            return False
        start = k + 2 if self._text(k + 1) in ("that", "then", "now", "please") else k + 1
        return (
            text in ("because", "cause", "though", "although") or self._opens(start) or self._subject(start) is not None
        )

    def _opens(self, k: int) -> bool:
        """Say whether an order may begin here."""
        found = self.tags[k] if k < len(self.tags) else set()
        return bool({"PREAMBLE", "NEGATION", "AVOID", "DESIRE"} & found) or self._text(k) in BASE_FORMS

    def _text(self, i: int) -> str:
        return self.texts[i] if 0 <= i < len(self.texts) else ""

    def _thing(self, k: int) -> bool:
        if k >= len(self.tokens) or self._modal(k):
            return False
        text = self.texts[k]
        if self._text(k - 1) in ("her", "his", "their") and text not in self.said.words.forms:
            return False
        ours = text in self.said.words.forms and len(text) > 2 and text not in GRAMMAR_WORDS
        return self.tokens[k].kind == "id" or ours or bool({"NOUN", "COLOUR"} & self.tags[k])

    def _modal(self, k: int) -> bool:
        """Say whether "can" is no thing: "I can see"."""
        before = self.tags[k - 1] if k else set()
        return self.texts[k] == "can" and not before & {"THE", "A", "COLOUR", "SIZE", "SHADE", "SUPER", "NUM"}

    def _refers(self, k: int, end: int) -> bool:
        """Say whether a pronoun stands for a thing here: "pick it", "do that"; but "I heard that ..." goes on."""
        text = self._text(k)
        return text in ("it", "them", "one", "ones") or (text in OBJECTS and k + 1 == end)

    def _subject(self, i: int, *, ordered: bool = True) -> int | None:
        """Return where the finite verb is whose subject begins at `i`; None if no statement begins there."""
        text, after = self._text(i), self._text(i + 1)
        if text in AUXILIARIES and (after in PERSONS or after in REFERRING):
            return i
        if text in QUESTIONS and text not in AUXILIARIES and after not in MARKS and not self._thing(i + 1):
            return i
        if text in PERSONS and after and after not in MARKS:
            return i + 1
        if text in REFERRING and (after in FINITE or self._verb(i + 1)):
            return i + 1
        noun = text in DETERMINERS
        if not (noun or self._unknown(i) or self._thing(i)) or (not noun and self._opens(i)):
            return None
        for k in range(i + 1 + noun, min(i + 8, len(self.texts))):
            if self._text(k) in MARKS or self._text(k) in JOINTS:
                return None
            # After an order, "y unchanged" is no sentence.
            if not self._thing(k) and (self._text(k) in FINITE or ((noun or not ordered) and self._verb(k))):
                return k
        return None

    def comments(self, start: int, end: int) -> bool:
        """Say whether somebody's remark has no matter of its own, and so is about the order: "my wife disagrees", "I doubt it"."""
        verb = self._subject(start)
        person = self._text(start) in PERSONS - {"you"} or self._text(start) in WHOSE
        return person and verb is not None and {*self.texts[verb + 1 : end]} <= OBJECTS | _OF_SAYING

    def _verb(self, k: int) -> bool:
        """Say whether a word looks like a finite verb of somebody: "my son spilled it"."""
        text = self._text(k)
        past = text.endswith("ed") and text not in BASE_FORMS and not self._thing(k - 1)
        return (self._unknown(k) and len(text) > 3 and text.endswith(("s", "ed"))) or (past and "VERB" in self.tags[k])

    def _unknown(self, k: int) -> bool:
        return k < len(self.tokens) and self.tokens[k].kind == "word" and not self.tags[k] and not self._thing(k)

    def _acts(self, k: int) -> bool:
        """Say whether a word stands for an act here; "empty" in "it is empty" does not."""
        noun = self._text(k - 1) in ARTICLES or self.texts[k - 1 : k + 1] == ["by", "hand"]
        state = (
            noun
            or self.texts[k] in ("getting", "got")
            or (self._text(k - 1) in BEING and not self._text(k).endswith(("ing", "ed")))
        )
        return "VERB" in self.tags[k] and not (state or self._thing(k) or self._text(k) in FINITE)

    def _past(self, k: int) -> bool:
        """Say whether a verb tells of what was done: "my cat knocked the tower down", "I keep dropping it"."""
        return self._text(k) not in BASE_FORMS and not self._text(k).endswith("s")

    def _idle(self, k: int) -> bool:
        """Say whether a word of place or number says nothing of a thing: "in here", "and all"."""
        if self._text(k) in ("here", "there", "all", "time", "way") or self._text(k + 1) in ("here", "there"):
            return self._text(k) != "all" or not (self._thing(k + 1) or self._text(k + 1) == "the")
        # "melting in the sun", "in my way"
        noun = k + 1 + (self._text(k + 1) in DETERMINERS)
        return "REL" in self.tags[k] and (self._unknown(noun) or self._text(noun) == "way")
