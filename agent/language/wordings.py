"""Other wordings of what the grammar knows: nominalized orders, shorthand, asides; each with the plainer words for it.

They are tried, in this order, on sentences that the grammar did not understand as they stand. `template` says how a
pattern reads and what it may leave out.
"""

from __future__ import annotations

from collections.abc import Sequence

from robosandbox.agent.language.idioms import plainly
from robosandbox.agent.language.template import Constructions
from robosandbox.agent.language.tokens import SceneWords, Token

_NAMELY = "(meaning|that is|that are|those are|these are|which is|which are|which means|that means|i mean|namely|specifically|in other words|as in)"
_ENOUGH = "(will|would|should|must|can|could|ought to) (do|suffice|be (enough|plenty|sufficient|fine|good|okay|right|perfect)) [it|nicely|the trick|for me]"
_ROOM = "(table|desk|tabletop|counter|bench|worktop|workbench|surface)"
_REST = "(the rest|everything else|all else|all the others|the others) [all] [goes|go|should go|can go|belongs|must go]"
_TOWER = "a (tower|stack|pile)"
_OPEN = "(yank|crack|pop|jerk|ease|fling|tug|pull|draw|slide|pry|swing|throw|wrench|get|roll)"
_SHUT = "(slam|push|shove|ease|bang|snap|pull|draw|nudge|slide|pop|knock|bump|press|swing|roll|get|put)"

SHORTHAND = {
    "{how:next|close|closer|adjacent|over} 2! {one}": "{how} to {one}",
    "{one} top of {one2}": "{one} on top of {one2}",
    "{one} front of {one2}": "{one} in front of {one2}",
    "in with (it|them|that one|the other|the others) <end>": "in there",
    "{adjective} as {_A} {_NOUN} {noun:thing|one|object|item}": "{adjective} {noun}",
}
DRAWERS = {
    "<verb> " + _OPEN + " {drawer} (open|out|ajar)": "open {drawer}",
    "<verb> " + _SHUT + " {drawer} [back] (shut|closed|in|to|home) <edge>": "close {drawer}",
    "<verb> (pull|slide|draw|roll) out {drawer}": "open {drawer}",
    "<verb> (push|slide|shove|press) [back] in {drawer}": "close {drawer}",
}
ORDERS = {
    # An order as a noun: "give me a lift of the can".
    "<verb> (give|do|have|take|make|perform) [me|us] {_A} [{_LIGHT_ADJECTIVE}] {LIGHT_NOUN} (of|to|on|for|at) {thing}": "{LIGHT_NOUN} {thing}",
    "<edge> up with {that}": "pick up {that}",
    "<verb> (come|go|head|return) back (for|to get|to fetch) {thing} <end>": "pick up {thing}",
    "<start> (can|could|may|might) i (have|get) {that} <end>": "pick up {that}",
    "<verb> {_VERB=tap} [on] {one} on (its|the) (top|head|lid|cap|tip|upper side)": "tap {one}",
    "<verb> roll {ball} {way}": "push {ball} {way}",
    "<verb> (top|crown|cap) {one} with {one2}": "put {one2} on {one}",
    "<verb> use {one} (as|for) (a|the|your) (base|foundation|bottom|support|stand|platform|pedestal|plinth) [,] [and|then] (put|place|set|stack) {thing} on (it|top|that)": "put {thing} on {one}",
    "<verb> [put|place|set|arrange] {thing} on [top of] {one} (as|in|into) " + _TOWER: "stack {thing} on {one}",
    "<edge> {thing} (should|must|need to|have to|are to|could) [all] (form|make|become|be) " + _TOWER: "stack {thing}",
    "<verb> {take:get|move|take|bring|carry|put} {thing} out of the way of {_one}": "{take} {thing} out of the way",
}
ENDS = {
    # The end in place of the deed.
    "<edge> it is {thing} [that] (i|we) (want|need|would like) {place}": "i want {thing} {place}",
    "(it|that) would (make me [so|very|really] (happy|glad)|please me|make my day) if! {thing}": "i want {thing}",
    "i want {one} had {thing} in it": "i want {one} to contain {thing}",
    "(i|we) (want|need|would like) [only!] {thing} [left|to stay|to remain] on (the|my|this) "
    + _ROOM
    + " [,|;] [and] "
    + _REST: "leave {thing} , put everything else",
    "no! {many} on the "
    + _ROOM
    + " [any more|anymore|any longer] (,|and) use {container}": "put all the {many} in {container}",
    "<start> (i|we) (am|have|are) [all|just] (finished|done) [with] {thing} (,|.|;|:|!) {VERB} {PRON}": "{thing} , {VERB} {PRON}",
}
ASIDES = {
    # What only adds that it is enough, that it has to be, that any will do; what is set right at once.
    "{distance} [,] [that] " + _ENOUGH + " <edge>": "{distance}",
    "a (hand|finger|palm|thumb) width , [that is] {distance}": "{distance}",
    "of (where it (is|stands|sits)|its (current|present) (place|position|spot|location))": "",
    "out of (here|there)": "out",
    "(,|and|but) (whichever|whatever) [one] you (like|want|prefer|choose|pick|fancy) [best|most]": "",
    "of your [own] (choice|choosing|liking|preference)": "",
    "rather {text} than {_place} <end>": "rather {text}",
    "<start> neither! {thing} nor! {thing2} [:|,] [but]": "do not touch {thing} and {thing2} .",
    "<start> not! {_one} , [but] {one}": "{one}",
    "(no|wait|oh) [,] [actually] (leave|forget|skip|drop) (it|that) [there|alone] (,|.|and)": "no ,",
    "(everything|anything|all|those|things) {_words} , " + _NAMELY + " {thing} ,": "{thing}",
    ", you [will|would] (have|need) to open (it|that) (first!|before!|beforehand) <edge>": "",
    "{thing} (a moment|a second!|a sec|briefly|momentarily) <edge>": "{thing}",
}  # fmt: skip
OPENED = Constructions(DRAWERS)
"""Tried before the idioms: "yank" alone pulls, "yank the drawer open" opens."""
WORDINGS = Constructions(SHORTHAND, ORDERS, ENDS, ASIDES)


def in_plain_words(tokens: Sequence[Token], words: SceneWords) -> tuple[Token, ...]:
    """Return the tokens with what has a plainer wording in that wording; the same tokens if there is none."""
    return WORDINGS.applied(plainly(OPENED.applied(tokens, words)), words)
