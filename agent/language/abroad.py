"""Orders as those say them who have the language from another one, each with the plainer words for it (see `template`)."""

from __future__ import annotations

# fmt: off
PARTS = {
    "mark": "(,|.|;|!|:)",
    "we": "(i|we)",
}
ASIDES_ABROAD = {
    "<edge> (how|what) [do|does|would] (you|we|they|one|i) (call|say|name) (it|that|this) [again!|in english|the word] <edge>": "",
    "<edge> (how (is|was) (it|that|this) (called|named|said)|how (it|that|this) is (called|named|said)|how to say|how you say|how do you say|how i say|how should i say|how is the (name|word)|what is the (name|word)) [it|that|again!|in english] <edge>": "",
    "[please|and] [kindly] do the needful [and|,]": "",
    "<start> [please] have the (kindness|goodness) to": "",
}
FOREIGN = {
    # As those say it who have it from another language, or are small.
    "<verb> [put|bring|get|move|take|go] [back] yourself [back] (in|to|at|into) [the|your] (start|starting|home|initial|rest|resting|base) (position|pose|place|point|spot)": "go home",
    "(to|towards|toward) the (far|other|opposite) side (from|of) (you|the robot|the arm)": "away from you",
    "(the|that) {NOUN} one": "the {NOUN}",
    "{all:each|every|all the|the} {word} [,] from [the] right to [the] left": "{all} {word} , rightmost first",
    "{all:each|every|all the|the} {word} [,] from [the] left to [the] right": "{all} {word} , leftmost first",
    "<verb> (change|exchange|switch|trade) [around] the (places|positions|spots) (of|between) {thing}": "swap {thing}",
    "<start> first! {thing} {place} , after! {thing2} <end>": "put {thing} {place} , then put {thing2} {place}",
    "<verb> give {adj:little|small|tiny|quick|gentle|light|soft|big|good} {LIGHT_NOUN} to": "give a {adj} {LIGHT_NOUN} to",
    "<verb> {_VERB=tap} (a bit|a little|a little bit) {thing}": "tap {thing}",
    "[with|of|in|that has|which has|that matches|which matches|matching] (its|their|its own|their own|the same) (colour|color)": "of the same colour",
    "(beside|next! to|near|by) {one} [,] [on|at|to] [the|its] {side:left|right} (side|hand side)": "to the {side} of {one}",
    "(put|place|stick|pop|drop) {thing} {place} (,|.|and|then) [and|then] (put|place|stick|pop|drop) {thing2} [also|too] (there|in there|on there)": "put {thing} {place} , then put {thing2} {place}",
    "<start> [put] {thing} [goes|go] {place} (,|;|.|and|then) [and|then] {thing2} (goes|go) [in|into|on] there [also|too]": "put {thing} {place} , then put {thing2} {place}",
    "<verb> (clear|get|move|take|shift|put) {thing} out of (my|our|the) way , (in|into) {one} with (it|them)": "put {thing} in {one}",
    "out of (my|our) way": "out of the way",
    "<start> [i (said|meant|mean|want)] {one} [,] [and] not! {_one2} (,|.|!) {VERB} {_PRON}": "{VERB} {one}",
    "not! {_place} [,] [and|or!|nor!] [also] (not!|nor!) {_place2} [,] but [only!] {place}": "{place}",
    "<start> {thing} {place} first! (.|,|;|!) [and] [only!] then": "{thing} {place} , then",
    "{VERB=tap} {thing} once! [each] [,]": "{VERB=tap} {thing}",
    "<verb> (put|place|stack|set) {one} on {one2} [,|.|and|then] [then|and] (on top of|on) (that|it|this|top) [goes|comes|put|place|you put] {thing}": "put {one} on {one2} , then put {thing} on {one}",
    "{word} what {is:is|are} {SUPER}": "{word} that {is} {SUPER}",
    "{NOUN} (what|who|which|which it|that it) {is:is|are} {COLOUR}": "{NOUN} that {is} {COLOUR}",
    "{all:all|everything} (what|who|which) {is:is|are} {COLOUR}": "{all} that {is} {COLOUR}",
    "<verb> (take|hold|grab) {thing} in [the|your|my] hand <edge>": "pick up {thing}",
    "<verb> (take|hold|grab) in [the|your|my] hand {thing}": "pick up {thing}",
    "(to|at|in) between of": "between",
    "<edge> {distance} (to|at) {forward:forward|forwards|backward|backwards}": "{forward} {distance}",
    "(to|the) {forward:forward|forwards|backward|backwards}": "{forward}",
    "<verb> give {thing} {adj:little|small|tiny|quick|gentle|light|soft|big|good} {LIGHT_NOUN}": "give {thing} a {adj} {LIGHT_NOUN}",
    "<verb> {open:open|close|shut} {thing} (good|well|complete|completely|fully|wide|tight|tightly|all the way|properly|firmly|all) <edge>": "{open} {thing}",
    "<edge> {thing} (must|should|have to|has to|need to|needs to) (change|switch|exchange|trade|swap) [their|the] (places|place|positions|spots)": "swap {thing}",
    "remaining {many:two|three|four}": "the other {many}",
    "<verb> {put:put|set|place|lay} {thing} back down {distance} {way}": "{put} {thing} down {distance} {way}",
    "(from|of) where (it|they) (is|are|stands|sits) [now|right now|currently|at the moment]": "",
}
# fmt: on
