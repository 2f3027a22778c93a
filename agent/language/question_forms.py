"""The forms of questions, as data: words with alternatives, and slots for descriptions of things.

In a form, `|` stands between alternatives, `_` joins words of one alternative, `?` ends what may be left out, `*` is the
description of one or more things, and `...` any words up to the end.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

_SEE = "do_you_see|can_you_see|you_see|are_there|is_there|there_are|do_you_count|do_you_find|are_here|are_visible|have_you|do_you_have|are_left"
_NOW = "now|right_now|at_the_moment|currently|please|then|exactly|still|already|yet|altogether|in_total|all_in_all"
_IN = "in|inside|inside_of|within"
_ON = "on|on_top_of|upon|sitting_on|standing_on|lying_on|stacked_on"
_TABLE = "the_table|the_desk|the_table_top|the_workspace"
_NEAR = "next_to|beside|near|close_to|by"
_LEFT = "left_of|to_the_left_of|on_the_left_of|on_the_left_side_of"
_RIGHT = "right_of|to_the_right_of|on_the_right_of|on_the_right_side_of"
_FRONT = "in_front_of|before"
_BACK = "behind|in_back_of"
_COLOUR = "colour|color|colours|colors"
_LIKE = "is|are * the_same {} as *"
_ARE = "is|are|lies|lie|sits|sit|stands|stand"

# What each form asks about, the form, and what it gives besides what fills its slots. The first that fits is answered.
_WRITTEN: tuple[tuple[str, str, dict[str, str]], ...] = (
    ("held", f"what are_you_holding|do_you_hold|have_you_got|do_you_have {_NOW}?", {}),
    ("held", "what is in|inside your|the hand|gripper|grip|fingers", {}),
    ("held", "what have_you_got|do_you_have|are_you_holding in your|the hand|gripper", {}),
    ("held", f"are_you_holding|do_you_hold|have_you_got anything|something|a_thing {_NOW}?", {}),
    ("held", "is your|the hand|gripper empty|free|full", {}),
    ("held", "is your|the hand|gripper holding anything|something", {}),
    ("whether_held", f"are_you_holding|do_you_hold|have_you_got|do_you_have * {_NOW}?", {}),
    ("all", "list|name|describe everything|all|all_objects|all_things|what you|that_you see|can_see", {}),
    ("all", f"what do_you_see|can_you_see|is_there|is_here|objects_do_you_see|things_do_you_see {_NOW}?", {}),
    ("all", "describe|list|name|show the|all|all_the scene|objects|things|table|everything", {}),
    ("all", "what is going_on|in_the_scene|in_front_of_you|around|out_there", {}),
    ("all", "what|which objects|things are_there|do_you_see|can_you_see|do_you_have", {}),
    ("on_table", f"what {_ARE} {_ON} {_TABLE} {_NOW}?", {}),
    ("on_table", f"what|which objects|things|stuff {_ARE}? {_ON} {_TABLE}", {}),
    ("where", f"where {_ARE} * {_NOW}?", {}),
    ("where", "where did|have you put|leave|left|place|placed *", {}),
    ("where", f"where * {_ARE}", {}),
    ("where", "where is|are * standing|lying|sitting|placed|located", {}),
    ("where", "where did|has|have * go|gone|move|moved|end_up", {}),
    ("where", "what is|are the position|location|coordinates of *", {}),
    ("where", f"is|are * {_IN} * or {_IN} *", {}),
    ("where", f"is|are * {_IN} * or {_ON} {_TABLE}", {}),
    ("where", "where can|could i|you find|see *", {}),
    ("where", "in_what|on_what|what place|which_place|container is|are *", {}),
    ("in", f"what {_ARE} {_IN} * {_NOW}?", {}),
    ("in", "what does * contain|hold|have_in_it|have_inside", {}),
    ("on", f"what {_ARE} {_ON} * {_NOW}?", {}),
    ("on", f"what does|is * stand|rest|lie {_ON}", {}),
    ("in", "how full is|are *", {}),
    ("in", f"is|are * {_NOW}? full", {}),
    ("reach", f"is|are * in|within|inside your|the? reach|range {_NOW}?", {}),
    ("reach", f"is|are * reachable {_NOW}?", {}),
    ("reach", f"can|could you reach|get_to * {_NOW}?", {}),
    ("reach", "is|are * out_of|outside|beyond your|the? reach|range", {"beyond": "yes"}),
    ("reach", f"is|are * unreachable|too_far_away|too_far for_you|to_reach? {_NOW}?", {"beyond": "yes"}),
    ("reached", "what|which of? *? can you reach|get_to", {}),
    ("reached", "what|which of? *? can not_you|you_not reach|get_to", {"beyond": "yes"}),
    ("reached", "what|which of? *? is|are in|within your|the? reach|range", {}),
    ("reached", "what|which of? *? is|are out_of|outside|beyond your|the? reach|range", {"beyond": "yes"}),
    ("fits", "can|does|will|would|could|do * fit in|into|inside *", {}),
    ("beside", f"what {_ARE} {_LEFT} *", {"side": "left"}),
    ("beside", f"what {_ARE} {_RIGHT} *", {"side": "right"}),
    ("beside", f"what {_ARE} {_FRONT} *", {"side": "front"}),
    ("beside", f"what {_ARE} {_BACK} *", {"side": "back"}),
    ("beside", f"what {_ARE} {_NEAR} *", {}),
    ("count_in", f"how_many * are|is|do_you_see|are_there {_IN} *", {"relation": "inside"}),
    ("count_in", f"how_many * are|is|do_you_see|are_there {_ON} *", {"relation": "on"}),
    ("count", f"how_many * {_SEE} {_NOW}?", {}),
    ("count", f"how_many * {_ARE} there|here|on_the_table", {}),
    ("count", "how_many * there_are|you_see|are_there", {}),
    ("colours", f"how_many colours|colors {_SEE} {_NOW}?", {}),
    ("count_such", f"how_many of? * {_ARE} *", {}),
    ("count", "how_many *", {}),
    ("count", "list|enumerate|name *", {}),
    ("colours", "what|which colours|colors do_you_see|can_you_see|are_there|are_here", {}),
    ("count", "what|which * do_you_see|can_you_see|are_there", {}),
    ("more", "are_there|do_you_see more * than *", {"wanted": "more"}),
    ("more", "are_there|do_you_see fewer|less * than *", {"wanted": "fewer"}),
    ("far_from_me", "how_far|how_far_away is|are * from you|me|the_robot|the_arm|the_base|the_robot's_base", {}),
    ("far_from_me", "how_far|how_far_away|how_far_off is|are *", {}),
    ("far", "how_far|how_far_away is|are * from|to *", {}),
    ("far", "how_far|how_far_away is_it from|between * to|and *", {}),
    ("far", "what_is_the_distance from|between * to|and *", {}),
    ("far_apart", "how_far apart are|is *", {}),
    ("far_apart", "what_is_the_distance between *", {}),
    ("what", "how big|large|tall|wide|high|long|small|thick|deep is|are *", {}),
    ("what", "what|which size|colour|color|colours|colors|shape|kind|dimensions is|are|has|have *", {}),
    ("what", "what are|is the size|colour|color|shape|dimensions|height|width of *", {}),
    ("mass", "how heavy is|are *", {}),
    ("mass", "what|how_much does|do * weigh", {}),
    ("count_in", f"which|what * {_ARE} {_IN} *", {"relation": "inside"}),
    ("count_in", f"which|what * {_ARE} {_ON} *", {"relation": "on"}),
    ("which", f"which|what of? * {_ARE} *", {}),
    ("whether_there", f"is|are there any|a|an|some|still|even? * {_NOW}?|here?|anywhere?|around?", {}),
    ("whether_there", "do|can you see|spot|find|have any|some? *", {}),
    ("on_table", f"is|are anything|something {_ON} {_TABLE} {_NOW}?", {}),
    ("in", f"is|are anything|something {_IN} * {_NOW}?", {}),
    ("on", f"is|are anything|something {_ON} * {_NOW}?", {}),
    ("whether_there", "is|are anything|something *", {}),
    ("whether_there", "is|are * still? there|here|around", {}),
    ("whether_there", "there is|are * right|correct|no|is_not_there|are_not_there", {}),
    ("whether_there", "if|whether there is|are any|a|an|some? *", {}),
    ("whether_on_table", f"if|whether * is|are {_ON} {_TABLE} {_NOW}?", {}),
    ("whether", f"if|whether * is|are {_IN} * {_NOW}?", {"relation": "inside"}),
    ("whether", f"if|whether * is|are {_ON} * {_NOW}?", {"relation": "on"}),
    ("whether_state", f"if|whether * is|are {_NOW}? open|opened", {"relation": "open"}),
    ("whether_state", f"if|whether * is|are {_NOW}? closed|shut", {"relation": "closed"}),
    ("whether_state", f"if|whether * is|are {_NOW}? empty", {"relation": "empty"}),
    ("whether_on_table", f"is|are * {_ON} {_TABLE} {_NOW}?", {}),
    ("whether_held", "is|are * in|inside your|the hand|gripper|fingers", {}),
    ("whether", f"is|are * {_IN} * {_NOW}?", {"relation": "inside"}),
    ("whether", f"is|are * {_ON} * {_NOW}?", {"relation": "on"}),
    ("whether_beside", f"is|are * {_LEFT} *", {"side": "left"}),
    ("whether_beside", f"is|are * {_RIGHT} *", {"side": "right"}),
    ("whether_beside", f"is|are * {_FRONT} *", {"side": "front"}),
    ("whether_beside", f"is|are * {_BACK} *", {"side": "back"}),
    ("whether_beside", f"is|are * {_NEAR} *", {}),
    ("whether_state", f"is|are * {_NOW}? open|opened", {"relation": "open"}),
    ("opening", "is|are * open|opened|closed|shut or open|opened|closed|shut", {}),
    ("whether_state", "how far|wide open is|are *", {"relation": "open"}),
    ("whether_state", "how far|wide is|are * open", {"relation": "open"}),
    ("whether_state", f"is|are * {_NOW}? closed|shut", {"relation": "closed"}),
    ("whether_state", f"is|are * {_NOW}? empty", {"relation": "empty"}),
    ("whether_state", f"is|are * {_NOW}? upright|standing|standing_up", {"relation": "upright"}),
    *(
        ("compared", f"{form} {word}{rest}", {"word": word})
        for word in (
            "bigger",
            "larger",
            "smaller",
            "taller",
            "higher",
            "shorter",
            "wider",
            "longer",
            "heavier",
            "lighter",
        )
        for form, rest in (("is|are *", " than *"), ("which|what is", " * or *"), ("which|what of? * or * is", ""))
    ),
    *(
        ("alike", form.replace("{}", f"{key}|{key}s".replace("colour|colours", _COLOUR)), {"of": key})
        for form in ("is|are * all|both? the_same|of_the_same {}", "do|does * all|both? have the_same {}", _LIKE)
        for key in ("size", "colour", "height")
    ),
    ("alike", "is|are * as big|large as *", {"of": "size"}),
    ("alike", "is|are * as tall|high as *", {"of": "height"}),
    ("nearer", "which|what is|one_is closer|nearer to_you|to_the_robot? * or *", {}),
    ("whether_is", "if|whether * is|are *", {}),
    ("whether_is", "is|are * *", {}),
    ("what", f"what|which {_ARE} *", {}),
    ("what", "which one|of_them|of_these|of_those is|are *", {}),
    ("abilities", "what can|could you do|make", {}),
    ("abilities", "what can|could i say|ask|tell_you", {}),
    ("abilities", "what are you able to do", {}),
    ("abilities", "help me?", {}),
    ("able", "are_you able_to ...", {}),
    ("able", "do_you_know|do how_to ...", {}),
    ("abilities", "what|who are you", {}),
    ("abilities", "what_is your name|job|purpose", {}),
    ("abilities", "what|which skills|commands do you have|know", {}),
    ("abilities", "what are your skills|abilities", {}),
    ("last", "what did|have you just? do|done last|before|first?", {}),
    ("last", "what was the_last_thing you did|have_done", {}),
    ("last", "have you moved|done anything|something yet|already?", {}),
    ("last", "what happened|went_wrong|was_that", {}),
    ("last", "why did that|it|you|this fail|not_work|stop", {}),
    ("last", "did that|it|you work|succeed|do_it|manage", {}),
)

# How a statement asks whether it is so: before it, or after it.
TRUTH = ("is it true that", "is it so that", "is it right that")
TAGS = ("is it not", "is not it", "are they not", "are not they", "right", "correct", "no", "yes")

# What a question may be wrapped in.
_GREETING = "please|and|so|ok|okay|robot|hey|hi|hello?"
_ASKING = (
    "tell_me|tell_us|do_you_know|do|can_you_tell_me|could_you_tell_me|i_wonder|say|show_me|i_want_to_know|i_would_like_to_know|"
    "can_you_say|do_you_remember|remind_me|please_tell_me?"
)


@dataclass(frozen=True, slots=True)
class Alternatives:
    """One part of a form: words of which one is said, or a slot.

    Attributes:
        words: The alternatives, each as its words.
        is_slot: Whether a description of things stands here.
        may_be_left_out: Whether it may be missing.
        is_rest: Whether any words up to the end stand here.
    """

    words: tuple[tuple[str, ...], ...] = ()
    is_slot: bool = False
    may_be_left_out: bool = False
    is_rest: bool = False


@dataclass(frozen=True, slots=True)
class Form:
    """A form of questions.

    Attributes:
        about: What it asks.
        parts: From the first word to the last.
        given: What the answer needs to know besides what fills the slots.
    """

    about: str
    parts: tuple[Alternatives, ...]
    given: dict[str, str] = field(default_factory=dict)


def _part(written: str) -> Alternatives:
    if written in ("*", "*?"):
        return Alternatives(is_slot=True, may_be_left_out=written == "*?")
    if written == "...":
        return Alternatives(is_rest=True)
    words = tuple(tuple(one.rstrip("?").split("_")) for one in written.split("|"))
    return Alternatives(words=words, may_be_left_out=written.endswith("?"))


def _by_first_word(forms: Sequence[Form]) -> dict[str, tuple[Form, ...]]:
    """Return the forms that may begin with a word, in their order; each begins with words and no slot."""
    first: dict[str, list[Form]] = {}
    for form in forms:
        for words in form.parts[0].words:
            first.setdefault(words[0], []).append(form)
    return {word: tuple(those) for word, those in first.items()}


# What may stand before a question: a form without slots.
OPENING = tuple(_part(part) for part in (_GREETING, _ASKING))
FORMS = tuple(Form(about, tuple(_part(part) for part in written.split()), given) for about, written, given in _WRITTEN)
FORMS_BY_WORD = _by_first_word(FORMS)
