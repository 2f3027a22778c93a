"""Templates: what a pattern takes, what it may leave out, and an example for every one in the tables."""

from __future__ import annotations

import random
import time
from collections import Counter
from collections.abc import Iterator, Sequence

import pytest

from robosandbox.agent.language.abroad import PARTS as PARTS_ABROAD
from robosandbox.agent.language.draft import Draft
from robosandbox.agent.language.interpret import interpret
from robosandbox.agent.language.slots import Said
from robosandbox.agent.language.template import (
    GUARDED,
    Choice,
    Constructions,
    Node,
    Slot,
    Template,
    TemplateError,
    Word,
)
from robosandbox.agent.language.tokens import Token, scene_words, tokenize
from robosandbox.agent.language.wordings import PARTS, TABLE, WORDINGS
from robosandbox.types import DetectedObject, ObservedScene, Pose

_WORDS = scene_words(("red_cube", "blue_cube", "can", "ball", "golf_ball", "tray", "bin", "box", "drawer", "sponge"))


def _tokens(text: str) -> tuple[Token, ...]:
    return tuple(Token(token.text, token.raw, token.kind) for token in tokenize(text, _WORDS))


def _said(tokens: tuple[Token, ...]) -> str:
    return " ".join(token.text for token in tokens)


@pytest.mark.parametrize(
    ("pattern", "outcome", "said", "becomes"),
    [
        ("toss {thing} (out|away)", "discard {thing}", "toss the can away", "discard the can"),
        ("toss {thing} [right] out", "discard {thing}", "toss the can right out", "discard the can"),
        ("toss {thing} [right] out", "discard {thing}", "toss the can out", "discard the can"),
        ("swap round {thing} <end>", "swap {thing}", "swap round the can and the ball.", "swap the can and the ball ."),
        ("flip {one} and {one2}", "swap {two} {one}", "", ""),
        ("shift {one} {place}", "put {one} {place}", "shift the can next to the tray", "put the can next to the tray"),
        ("{go:wander|stroll off} home", "{go} back", "stroll off home", "stroll off back"),
        ("{VERB=push} hard {thing}", "{VERB=push} {thing}", "shove hard the can", "shove the can"),
        ("zork 2! {thing}", "pick {thing}", "zork 2 red_cube", "pick red_cube"),
        ("zork {distance}", "move {distance}", "zork 5 cm", "move 5.0 cm"),
        ("zork {drawer}", "open {drawer}", "zork the can", "zork the can"),
        ("zork {ball}", "roll {ball}", "zork the golf ball", "roll the golf ball"),
        ("<start> zork", "pick", "please zork, then zork", "pick , then zork"),
        ("<verb> zork", "pick", "the zork and zork", "the zork and pick"),
        ("<edge> {that} zorks <edge>", "pick {that}", "tap the can, the ball zorks", "tap the can , pick the ball"),
        ("rather {text} than {_place} <end>", "{text}", "rather pick the can than in the bin", "pick the can"),
    ],
)  # fmt: skip
def test_pattern_takes_phrases_and_carries_them_over(pattern: str, outcome: str, said: str, becomes: str) -> None:
    if not said:
        with pytest.raises(TemplateError, match="lacks"):
            Template.read(pattern, outcome)
        return
    assert _said(Constructions({pattern: outcome}).applied(_tokens(said), _WORDS)) == becomes


@pytest.mark.parametrize(
    ("pattern", "outcome", "error"),
    [
        ("pick {thing} once it is there", "pick {thing}", "leaves out “once”"),
        ("pick {thing} [if you can]", "pick {thing}", "leaves out “if”"),
        ("(pick|never pick) {thing}", "pick {thing}", "leaves out “never”"),
        ("pick 2 {thing}", "pick {thing}", "leaves out “2.0”"),
        ("pick {thing} and {thing2}", "pick {thing}", "leaves out {thing2}"),
        ("pick up! {thing}", "pick {thing}", "binds nothing"),
        ("not! {thing}", "not {thing}", "is not left out"),
        ("pick {gadget}", "pick {gadget}", "no phrase is called"),
        ("pick (up {thing}", "pick {thing}", "is not closed"),
        ("pick up) {thing}", "pick {thing}", "closes nothing"),
        ("<middle> pick {thing}", "pick {thing}", "no place is called"),
        ("{thing} [there]", "{thing}", "no word that must be there"),
    ],
)
def test_template_that_leaves_out_what_binds_is_an_error(pattern: str, outcome: str, error: str) -> None:
    with pytest.raises(TemplateError, match=error):
        Template.read(pattern, outcome)


@pytest.mark.parametrize(
    "said",
    [
        "all if hot, namely the can, in the bin",
        "all but 2 things, namely the can, in the bin",
        "all not red, namely the can,",
    ],
)
def test_what_is_left_out_never_holds_a_condition_or_number(said: str) -> None:
    table = Constructions({"all {_words} , namely {thing} ,": "{thing}"})
    tokens = tuple(Token(word, word, "word") for word in said.replace(",", " ,").split())
    assert table.applied(tokens, _WORDS) == tokens
    assert (
        _said(table.applied(_word_tokens("all that shines , namely the can , in the bin"), _WORDS))
        == "the can in the bin"
    )


def test_template_is_tried_where_its_rarest_words_are_said() -> None:
    template = Template.read("{one} and {one2} [,] (vice versa|the other way round)", "swap {one} and {one2}")
    assert {"vice", "other"} in template.needed
    assert not template.may_fit(frozenset({"the", "can", "and", "ball"}))


def test_no_phrase_is_read_where_nothing_after_it_can_match() -> None:
    asked: list[int] = []

    class Asked(Said):
        def ends(self, kind: str, i: int) -> list[int]:
            asked.append(i)
            return super().ends(kind, i)

    template = Template.read("{one} [right] next (2!|two!) {one2}", "{one} next to {one2}")
    texts = ["put", "the", "can", "next", "two", "the", "ball"]
    said = template.applied(Asked([Token(text, text, "word") for text in texts], _WORDS))
    assert said is not None
    assert said.texts == ["put", "the", "can", "next", "to", "the", "ball"]
    # The first "{one}" stands before "next" alone: not at "next" itself, nor after it.
    assert asked == [0, 1, 5]


_EXAMPLES = """
    to the left of the can , 10 cm away -> 10.0 cm to the left of the can
    behind the can , 10 cm away -> 10.0 cm behind the can
    have a lift of the can -> lift the can
    the can needs moving to the bin -> start moving the can to the bin
    swap the can and the ball , that each stands where the other one is -> swap the can and the ball
    roll the ball to the left -> push the ball to the left
    my mum wants the can in the bin -> the can in the bin
    take the can , use the bin for it -> take the can , put it in the bin
    the can does not belong there , it goes in the bin -> put the can in the bin
    push the can 5 cm , that should do -> push the can 5.0 cm
    10 cm to the right of where it is -> 10.0 cm to the right
    put the can where the ball used to be -> put the can where the ball was
    the can you put in the bin -> put the can in the bin
    the can , in the bin put it -> put the can in the bin
    i need that the can goes in the bin -> i want the can in the bin
    the can lives in the bin , put it there -> put the can in the bin
    everything that rolls , so the ball , goes in the bin -> everything that rolls , so the ball goes in the bin
    no not the can , the ball ! tap the ball -> do not touch the can . tap the ball
    teacher says tap the can -> tap the can
    make that the can is in the bin -> i want the can in the bin
    tap the can , that is all for now -> tap the can , that is all
    tap the can when you are finished -> tap the can
    tap the can or the ball , i do not mind which -> tap the can or the ball
    shove the can in the bin -> put the can in the bin
    lift the can onto the tray -> put the can onto the tray
    i do not want the can there , tap it -> the can , tap it
    fair enough , tap the can -> tap the can
    whatever you do , tap the can -> tap the can
    tap the can by noon -> tap the can
    two taps on the can -> tap the can two times
    tap in this order : the can and the ball -> tap the can and the ball
    tap test : the can and the ball -> tap the can and the ball
    put the can on the tray , in the bin i mean -> put the can on the tray , no , in the bin
    tap the can , actually leave it , tap the ball -> tap the can , no , tap the ball
    put the can in the drawer and leave it open -> put the can in the drawer
    tap the balls , namelyonly the golf ball -> of the balls , tap the golf ball
    grab the cup with the marble -> grab the cup with marble in it
    the can belongs in the bin , so put it away -> put the can in the bin
    tap the balls except the golf ball , that one stays -> tap the balls except the golf ball
    push the can , to the left -> push the can to the left
    the can and nothing else in the bin -> the can in the bin
    put the can in the drawer , and close the drawer once it is in -> put the can in the drawer , then close the drawer
    the can belongs in the bin , so put it there -> put the can in the bin
    tap the can , after that tap the ball -> tap the can , then tap the ball
    tap the , can -> tap the can
    grab the can and hold it up for me -> grab the can and hold it
    grab the can and keep hold of it -> grab the can and hold it
    for the can , tap it -> tap the can
    both balls in the bin of their own colour -> both balls in the bin of the same colour
    the can should really be in the bin -> put the can in the bin
    the can belongs in the bin -> put the can in the bin
    tap the can , no , that is too much , but tap the ball -> tap the can , no , tap the ball
    tap the can , sorry , wait , no , tap the ball -> tap the can , no , tap the ball
    halfway between the can and the ball -> between the can and the ball
"""


def _word_tokens(text: str) -> tuple[Token, ...]:
    return tuple(
        Token(str(float(word)), word, "number")
        if word.isdigit()
        else Token(word, word, "word" if word[0].isalpha() else "mark")
        for word in text.split()
    )


def test_every_template_has_an_example_and_makes_of_it_what_is_said() -> None:
    # Those of a second language are shown by the sentences of tests/prompts.
    unused = {template.source for template in Constructions(TABLE, parts={**PARTS_ABROAD, **PARTS}).templates}
    for line in _EXAMPLES.strip().splitlines():
        said, becomes = (part.strip() for part in line.split("->"))
        tokens = _word_tokens(said)
        alone = [Constructions({t.source: " ".join(t.outcome)}) for t in WORDINGS.templates if t.source in unused]
        unused -= {one.templates[0].source for one in alone if one.applied(tokens, _WORDS) != tokens}
        assert (said, _said(WORDINGS.applied(tokens, _WORDS)).strip(" ,")) == (said, becomes)
    assert not unused


_PHRASES = {
    "thing": "the can", "one": "the tray", "that": "the box", "many": "the balls", "ball": "the golf ball", "drawer": "the drawer", "container": "the bin",
    "place": "in the bin", "distance": "5 cm", "way": "to the left", "doing": "moving", "adjective": "red", "bare": "red cubes", "person": "mum", "praise": "be so kind",
    "word": "mighty", "words": "that rolls", "text": "have the can in the box", "VERB": "bin", "VERB=tap": "pat", "VERB=swap": "exchange", "VERB=push": "push", "VERB=move": "move", "VERB=close": "shut", "holder": "the bin", "PRON": "it", "A": "a", "NOUN": "marble",
    "SUPER": "smallest", "name": "bennett", "COLOUR": "pink", "VERB=pick": "grab", "VERB=put": "place", "LIGHT_NOUN": "push", "LIGHT_NOUN=tap": "pat", "LIGHT_ADJECTIVE": "gentle",
}  # fmt: skip


def _spoken(nodes: Sequence[Node], rng: random.Random) -> Iterator[str]:
    """One of the sentences that a pattern takes."""
    for node in nodes:
        if isinstance(node, Choice):
            yield from _spoken(rng.choice(node.options), rng)
        elif isinstance(node, Slot):
            yield from _PHRASES[node.kind].split()
        elif isinstance(node, Word):
            yield node.text


def _marked(nodes: Sequence[Node]) -> Iterator[str]:
    for node in nodes:
        if isinstance(node, Choice):
            for option in node.options:
                yield from _marked(option)
        elif isinstance(node, Word) and node.dropped:
            yield node.text


def test_no_template_loses_a_word_that_binds_unless_it_marks_it() -> None:
    rng = random.Random(0)
    guarded, fitted = sorted(GUARDED), set()
    for template in WORDINGS.templates:
        marked = set(_marked(template.pattern))
        for n in range(30):
            said = list(_spoken(template.pattern, rng))
            if n:
                said.insert(rng.randrange(len(said) + 1), rng.choice(guarded))
            tokens = _word_tokens(" ".join(said))
            made = template.applied(Said(tokens, _WORDS))
            if made is None:
                continue
            fitted.add(template.source)
            before, after = (Counter(t.text for t in ts if t.text in GUARDED) for ts in (tokens, made.tokens))
            # "no, no:" made "no," has lost nothing: the template says it once more itself.
            assert not {*(before - after)} - marked - {*template.outcome}, (template.source, " ".join(said), made.texts)
    assert len(fitted) > 0.9 * len(WORDINGS.templates)


def test_words_that_no_template_has_cost_next_to_nothing() -> None:
    tokens = _word_tokens("grab red cube")
    start = time.process_time()
    for _ in range(1000):
        assert WORDINGS.applied(tokens, _WORDS) == tokens
    assert (time.process_time() - start) / 1000 < 1e-3


SCENE = ObservedScene(
    time=0.0,
    table_height=0.04,
    base_xy=(-0.3, 0.0),
    objects=tuple(
        DetectedObject(id=name, kind=kind, size=size, colour=colour, rgba=(0.5, 0.5, 0.5, 1.0), pose=Pose(xyz=xyz), opening=opening)
        for name, kind, size, colour, xyz, opening in (
            ("lemon", "sphere", (0.025,), "yellow", (0.0, 0.32, 0.065), None),
            ("red_cube", "box", (0.02, 0.02, 0.02), "red", (0.15, 0.1, 0.06), None),
            ("blue_cube", "box", (0.025, 0.025, 0.025), "blue", (0.15, -0.1, 0.065), None),
            ("tray", "bin", (0.07, 0.07, 0.02), "grey", (0.22, 0.28, 0.04), None),
            ("drawer", "drawer", (0.2, 0.18, 0.1, 0.12), "brown", (0.36, -0.25, 0.04), 0.0),
        )
    ),
)  # fmt: skip
SKILLS = [
    "pick",
    "place_on",
    "place_in",
    "place_at",
    "place_beside",
    "stack",
    "push",
    "tap",
    "open_drawer",
    "close_drawer",
    "home",
]


@pytest.mark.parametrize(
    ("said", "calls"),
    [
        ("put the cubes in the tray, smallest first", "pick(object=red_cube); place_in(container=tray); pick(object=blue_cube); place_in(container=tray)"),
        ("cubes into the tray, starting with the biggest", "pick(object=blue_cube); place_in(container=tray); pick(object=red_cube); place_in(container=tray)"),
        ("put the cubes in the tray, both of them", "pick(object=red_cube); place_in(container=tray); pick(object=blue_cube); place_in(container=tray)"),
        ("not the red cube, the blue one: tap it", "tap(object=blue_cube)"),
        ("take the lemon and leave it standing in the tray", "pick(object=lemon); place_in(container=tray)"),
        ("whichever thing is red, tap it", "tap(object=red_cube)"),
        ("stack the cubes, red on blue", "stack(object=red_cube, target=blue_cube)"),
        ("build a tower with the cubes: red, blue from the bottom up", "stack(object=blue_cube, target=red_cube)"),
        ("the red cube goes in the tray, and the lemon does too", "pick(object=red_cube); place_in(container=tray); pick(object=lemon); place_in(container=tray)"),
        ("the red cube goes in the tray and the lemon joins it there", "pick(object=red_cube); place_in(container=tray); pick(object=lemon); place_in(container=tray)"),
        ("push the lemon back 5 cm, then left by the same amount", "push(object=lemon, direction=back, distance=0.05); push(object=lemon, direction=left, distance=0.05)"),
        ("put the lemon in the tray and go home afterwards", "pick(object=lemon); place_in(container=tray); home()"),
        ("put the lemon in the drawer but leave the drawer open", "open_drawer(drawer=drawer); pick(object=lemon); place_in(container=drawer)"),
    ],
)  # fmt: skip
def test_orders_kinds_and_ellipses_are_read_by_the_grammar(said: str, calls: str) -> None:
    draft = interpret(said, SCENE, SKILLS)
    assert isinstance(draft, Draft), draft.message
    assert "; ".join(map(str, draft.calls)) == calls


@pytest.mark.parametrize(
    "said",
    [
        "go home once it is done",
        "tap the lemon after it is moved",
        "put the lemon in the tray, smallest first",
        "put the lemon in the tray and close the drawer, but leave the drawer open",
        "stack the cubes, green on blue",
        "use the tray as a base unless it is full and put the lemon on it",
        "roll the lemon until it stops",
        "i have finished with the lemon unless you need it, put it in the tray",
        "it would make me happy if you never touched the lemon",
        "may i have the lemon back",
        "give the lemon a second push to",
        "everything that is not red, meaning the lemon, in the tray",
    ],
)
def test_what_binds_is_refused_rather_than_left_out(said: str) -> None:
    assert not isinstance(interpret(said, SCENE, SKILLS), Draft)
