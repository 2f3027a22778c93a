"""Other wordings of what the grammar knows: nominalized orders, shorthand, asides; each with the plainer words for it.

They are tried, in this order, on sentences that the grammar did not understand as they stand. `template` says how a
pattern reads and what it may leave out.
"""

from __future__ import annotations

from robosandbox.agent.language.idioms import plainly
from robosandbox.agent.language.slots import Said
from robosandbox.agent.language.template import Constructions

# fmt: off
PARTS = {
    "namely": "(meaning|that is|that are|those are|these are|which is|which are|which means|that means|i mean|namely|specifically|in other words|as in)",
    "enough": "(do|suffice|be (enough|plenty|sufficient|fine|good|okay|right|perfect)) [it|nicely|the trick|for me]",
    "will": "(will|would|should|must|can|could|ought to)",
    "room": "(table|desk|tabletop|counter|bench|worktop|workbench|surface)",
    "rest": "(the rest|everything else|all else|all the others|the others) [all] [goes|go|should go|can go|belongs|must go]",
    "tower": "a (tower|stack|pile)",
    "base": "(base|foundation|bottom|support|stand|platform|pedestal|plinth)",
    "takes": "(takes|take|gets|get|has|have|ends up in|end up in|goes to|go to)",
    "theirs": "(the [other] other|each other|one another|the others)",
    "stands": "(is|are|stands|stand|sits|sit|goes|go|lies|lie|ends up|end up|comes|come)",
    "reversed": "(vice versa|the other way round|the other way around)",
    "wants": "(wants|want|needs|need|would like|would love|would prefer|asked for|asks for)",
}
SHORTHAND = {
    "{how:next|close|closer|adjacent|over} 2! {one}": "{how} to {one}",
    "{one} top of {one2}": "{one} on top of {one2}",
    "{one} front of {one2}": "{one} in front of {one2}",
    "in with (it|them|that one|the other|the others) <end>": "in there",
    "up in (a|one) {row:row|line}": "in a {row}",
    "[the] first! {number:two|three|four|five} {word} [counting|starting] from [the] left": "the {number} leftmost {word}",
    "[the] first! {number:two|three|four|five} {word} [counting|starting] from [the] right": "the {number} rightmost {word}",
    "[the] last! {number:two|three|four|five} {word} [counting|starting] from [the] left": "the {number} rightmost {word}",
    "[the] last! {number:two|three|four|five} {word} [counting|starting] from [the] right": "the {number} leftmost {word}",
    "the {SUPER} {number:two|three|four|five} {many}": "the {number} {SUPER} {many}",
    "(to the|on the) {side:left|right} of {one} [,] {distance} (away [from it]|apart|off|from it)": "{distance} to the {side} of {one}",
    "{side:in front of|behind} {one} [,] {distance} (away [from it]|apart|off|from it|<edge>)": "{distance} {side} {one}",
    "{adjective} as {_A} {_NOUN} {noun:thing|one|object|item}": "{adjective} {noun}",
    "{adjective} like [a|the] {_NOUN}": "{adjective}",
    "{thing} at the {side:left|right} <end>": "{thing} to the {side}",
    "{distance} at the {side:left|right}": "{distance} to the {side}",
    "(at|on|in|to|by) [the] (back|rear) side of {one}": "behind {one}",
    "(back|rear) side of {one}": "behind {one}",
    "[at|on|in|to|by] [the] front side of {one}": "in front of {one}",
    "in front of {one} [,] (on|at|to) the side (that faces|which faces|facing|towards|nearest) [to] (the robot|you|the arm)": "in front of {one}",
    "(on|onto|on to|in|into) the (centre|center|middle) of {one}": "on {one}",
    "(on|onto|on to) {one} above <edge>": "on {one}",
    "used to (be|stand|sit|lie)": "was",
    "the both {many}": "both {many}",
    "the {SUPER} {NOUN} but one": "the second {SUPER} {NOUN}",
    "<verb> (tidy|clean|clear) up (a bit|a little|a little bit)": "tidy up",
    "<start> (tidy|clean|clear) up (,|.|;|and) {VERB=put} {thing}": "{VERB=put} {thing}",
    "in the middle [,] (counting|counted|as counted|going) from [the|either|any] (left|right|side|end) [to [the] (left|right)]": "in the middle",
    "{that} (there|here|over there|over here) ,": "{that} ,",
    "the {adjective} one {NOUN}": "the {adjective} {NOUN}",
    "(everything|all|all things|things) what is": "everything that is",
}
DRAWERS = {
    "<verb> (yank|crack|pop|jerk|ease|fling|tug|pull|draw|slide|pry|swing|throw|wrench|get|roll) {drawer} (open|out|ajar)": "open {drawer}",
    "<verb> (slam|push|shove|ease|bang|snap|pull|draw|nudge|slide|pop|knock|bump|press|swing|roll|get|put) {drawer} [back] (shut|closed|in|to|home) <edge>": "close {drawer}",
    "<verb> (pull|slide|draw|roll) out {drawer}": "open {drawer}",
    "<verb> (push|slide|shove|press) [back] in {drawer}": "close {drawer}",
}
ORDERS = {
    # An order as a noun: "give me a lift of the can"; a wish as one: "the can needs moving to the bin".
    "<verb> (give|do|have|take|make|perform|i want|i need|i would like) [me|us] {_A} [{_LIGHT_ADJECTIVE}] {LIGHT_NOUN} (of|to|on|for|at) {thing}": "{LIGHT_NOUN} {thing}",
    "<verb> (have|take|try) a (go|try|shot|stab|crack) at {doing}": "start {doing}",
    "<edge> {thing} (needs|need|wants|want|requires|require|deserves) {doing}": "start {doing} {thing}",
    "<verb> (go|return|come|get|move) [back] to (your|its) (place|spot|corner|post) <edge>": "go home",
    "<start> you shall {VERB}": "{VERB}",
    "and to {VERB} {thing}": "and {VERB} {thing}",
    "<verb> let fall {thing}": "drop {thing}",
    "<verb> {VERB=pick} {thing} [,] (but|and) [do] not! let [go] [of] {_PRON} [go] <end>": "{VERB=pick} {thing}",
    "<verb> make that {thing} (is|are|goes|go|comes) {place}": "i want {thing} {place}",
    "(would|are|will) you [be] able {doing}": "start {doing}",
    "<start> (pick and place|put|place|move) : {thing} {place}": "put {thing} {place}",
    "<start> {thing} (goes|go|comes) first! {place} [,] and [only!] then {thing2} <end>": "put {thing} {place} , then put {thing2} {place}",
    "<verb> {VERB=pick} {thing} [,] (but|and) do not! (put|place|drop|set) {_PRON} (anywhere|down|away) [yet!] <end>": "{VERB=pick} {thing}",
    "(finish|finish up|finish off|end|end up|conclude|wind up|stop) (in|at|with) [your|the|its] home [position|pose|place]": "go home",
    "<verb> (tidy|clear|clean|pack|put) (away|up) {many} , (each|all|each one|every one) in": "put {many} in",
    "<verb> (fish|dig|scoop) {thing} out (of|from) {one}": "take {thing} out of {one}",
    "<verb> nest {one} (in|inside|into|within) {one2}": "put {one} in {one2}",
    "<start> {order:from bottom to top|from top to bottom|from the bottom up|from the top down|bottom up|top down|bottom to top|top to bottom} [,|:] (i want|i would like|we want|give me|make|build|make me|build me) <tower> (of|from|with|out of) {thing} <end>": "build a tower of {thing} {order}",
    "<verb> (make|build|do) [me|us] <tower> [for me|for us] (.|,|:|;) {order:from bottom to top|from top to bottom|from the bottom up|from the top down|bottom up|top down|bottom to top|top to bottom} [,|:] [i want|i would like|it is|it goes|it should be] {thing} <end>": "build a tower of {thing} {order}",
    "<start> {number:two|three|four|five} high [,] [please] :": "build a tower of {number} :",
    # As those say it who have it from another language.
    "<verb> {VERB} you {thing}": "{VERB} {thing}",
    "<start> [please] you [to] {VERB} {thing}": "{VERB} {thing}",
    "<edge> {thing} you (put|place) {place} <end>": "put {thing} {place}",
    "{place} you {VERB} <edge>": "{VERB} {place}",
    "<edge> {thing} , {place} {VERB} {_PRON} <edge>": "{VERB} {thing} {place}",
    "<start> which (one|thing) is {adjective} [,] {VERB}": "{VERB} the {adjective} one",
    "(use|with) [your|the] (hand|gripper|finger|arm|claw|fingers) [to|and] {VERB} {thing}": "{VERB} {thing}",
    "<verb> ring {one} [,] [by] (touching|tapping|pressing) (it|the top) [from above|on top|on the top]": "tap {one}",
    "<edge> (up|off) with {that}": "pick up {that}",
    "<edge> (away|in|off) with {that} [,] {place}": "put {that} {place}",
    "<edge> (so does|so do|ditto [for|with]|likewise|[the] same goes for) {thing} <end>": "then {thing}",
    "<verb> (come|go|head|return) back (for|to get|to fetch) {thing} <end>": "pick up {thing}",
    "<start> (can|could|may|might) i (have|get) {that} <end>": "pick up {that}",
    "<verb> {_VERB=tap} [on] {one} on [its|the|his|her] (top|head|lid|cap|tip|upper side)": "tap {one}",
    "<verb> give {one} (a|one) [{_LIGHT_ADJECTIVE}] {LIGHT_NOUN=tap} on [its|the|his|her] (top|head|lid|cap|tip|upper side)": "{LIGHT_NOUN=tap} {one}",
    "<edge> (a|one) [{_LIGHT_ADJECTIVE}] {LIGHT_NOUN=tap} (on|for|to) {thing} <edge>": "{LIGHT_NOUN=tap} {thing}",
    "mind [that] you {leave:leave|keep|spare|let}": "{leave}",
    "<verb> roll {ball} {way}": "push {ball} {way}",
    "<verb> (top|crown|cap) {one} with {one2}": "put {one2} on {one}",
    "<verb> (put|place|set|move|bring) {one} [to] where {one2} (is|stands|sits) [,] [and] <reversed>": "swap {one} and {one2}",
    "<verb> {put:put|place|set|stand} {thing} [right] up against {one}": "{put} {thing} next to {one}",
    "<verb> use {one} (as|for) (a|the|your) <base> [,] [and|then] (put|place|set|stack) {thing} on (it|top|that)": "put {thing} on {one}",
    "<verb> [put|place|set|arrange] {thing} on [top of] {one} (as|in|into) <tower>": "stack {thing} on {one}",
    "<edge> {thing} (should|must|need to|have to|are to|could) [all] (form|make|become|be) <tower>": "stack {thing}",
    "<verb> {take:get|move|take|bring|carry|put} {thing} out of the way of {_one}": "{take} {thing} out of the way",
}
ENDS = {
    # The end in place of the deed.
    "<start> (my|our|the|your) {_person} <wants> {thing}": "i want {thing}",
    "<start> {thing} {place} [,] (is|that is) (what|all) (i|we) <wants> <end>": "i want {thing} {place}",
    "<edge> it is {thing} [that] (i|we) <wants> {place}": "i want {thing} {place}",
    "(i|we) (would|will) be [ever|so|very|most|really|quite] [so] (grateful|happy|glad|pleased|obliged|delighted|thankful) if! {thing} (ended up|went|were|was|could go|could be|could be put|would go|got put|found its way|found their way|landed) {place}": "put {thing} {place}",
    "(it|that) would (make me [so|very|really] (happy|glad)|please me|make my day) if! {thing}": "i want {thing}",
    "i want {one} had {thing} in it": "i want {one} to contain {thing}",
    "<start> (me and {_name}|{_name} and (i|me)) <wants> {thing}": "i want {thing}",
    "<start> {_name} <wants> {thing}": "i want {thing}",
    "(i|we) <wants> that {thing} (go|goes|come|comes|is|be|gets|lands|ends up) {place}": "i want {thing} {place}",
    "i want {thing} (go|goes|come|comes|is|be|gets|lands|ends up) {place}": "i want {thing} {place}",
    "i (like|love|prefer|wish) to have {thing} {place}": "i want {thing} {place}",
    "<start> {thing} (i|we) (need|want) {place} <end>": "i want {thing} {place}",
    "(it|that) would {_praise} (to have|having|to see) {thing}": "i want {thing}",
    "<start> {thing} [,] i want it {place}": "i want {thing} {place}",
    "i do not! want {thing} {_place} [,|;|.|but] [and|but] i want it {place}": "i want {thing} {place}",
    "<edge> {thing} (lives|live|belongs|belong|goes|go|is kept|are kept) {place} [,|;|.] [and|so] (put|stick|pop|place|drop) {_PRON} [in|back] there": "put {thing} {place}",
    "{one} {place} [,|and] {one2} {place2} [,] [no!|actually|wait] [,] <reversed>": "{one} {place2} , {one2} {place}",
    "; {thing} (does|do) not! <end>": ". leave {thing}",
    "(i|we) <wants> [only!] {thing} [left|to stay|to remain] on (the|my|this) <room> [,|;] [and] <rest>": "leave {thing} , put everything else",
    "no! {many} [left|lying] on the <room> [any more|anymore|any longer] (,|and) (use|put them (in|into)|they [all] go (in|into)) {container}": "put all the {many} in {container}",
    "(,|and|then) use {container} [for (it|that|them)] <end>": "into {container}",
    "<start> (i|we) (am|have|are) [all|just] (finished|done) [with] {thing} (,|.|;|:|!) {VERB} {PRON}": "{thing} , {VERB} {PRON}",
}
ASIDES = {
    "<edge> {thing} (is|are) (on|in|at) the wrong (side|place|spot|end|position) (,|.|;|:)": "{thing} ,",
    "<edge> {thing} (should|must|can) not! (be|go|stand|sit|lie) (with|among|near|by|there|here) [{_thing}] (,|.|;|:)": "{thing} ,",
    "<edge> {thing} (has to|have to|needs to|need to|must|should) (stay|remain|keep|be kept) (cold|warm|dry|clean|safe|cool|fresh|upright|{_name}) (,|.|;|:)": "{thing} ,",
    "<edge> (i|we|he|she|my {_person}) (can|could) not! (reach|get|get at|get to|grab|see|lift|move|pick up|hold) {thing} (,|.|;)": "{thing} ,",
    "<edge> (someone|somebody|i|my {_person}) [has|have] (left|forgot|dropped) {that} {_place} (,|.|;|:)": "{that} ,",
    "<start> {one} {_name} (!|.|,|;) [!] [!] {VERB} it": "{one} , {VERB} it",
    "(everything|anything|all|those|things) {_words} , so {thing} ,": "{thing}",
    "(a bit|a little|a little bit|slightly) {way} [,] [like|about] {distance}": "{distance} {way}",
    ", where (it|they) (belongs|belong|lives|live|goes|go|[always] (is|are|was|were)|(has|have) always (gone|been|lived)|should be|should have been) <end>": "",
    "(on|in|into|onto|under|behind|beside|at|to|next! to|to the) , (no! [,] [wait|sorry|hang on|hold on|actually]|wait|sorry|hang on|hold on|actually) [,] {place}": "{place}",
    "<start> (as for|regarding|concerning|with regard to|what about|how about) {thing} (,|:)": "{thing} ,",
    "<edge> {thing} (is|are) not! where (it|they) (should be|ought to be|belong|belongs|goes|go) (,|.)": "{thing} ,",
    "<edge> {thing} (does|do) not! belong (here|there|on the <room>) (,|.) [but] (it|they)": "{thing}",
    # What only adds that it is enough, that it has to be, that any will do; what is set right at once.
    "{VERB=swap} {thing} [,] [and] [so|such] [that] (each|each one|each of them|both|they|the one|one|every one) [now|then] (<takes> the place of the other [one]|<takes> <theirs> place|(<stands>|<will> (be|stand|sit|go|lie|end up)) where the other [one] [currently] (is|was|stands|stood|sits|sat|lies|lay) [now|before!]) <end>": "{VERB=swap} {thing}",
    "{VERB=swap} {thing} [,] [and] [so|such] [that] they [have|will] [have] (changed|swapped|traded|exchanged|change|swap|trade|exchange) [their] (places|positions|spots) <end>": "{VERB=swap} {thing}",
    "{distance} [,] [that] (<will> <enough>|(is|are) (enough|plenty|sufficient|fine)|suffices) <edge>": "{distance}",
    "a (hand|finger|palm|thumb) width , [that is] {distance}": "{distance}",
    "of (where it (is|stands|sits)|its (current|present) (place|position|spot|location))": "",
    "out of (here|there)": "out",
    "(,|and|but) (whichever|whatever) [one] you (like|want|prefer|choose|pick|fancy) [best|most]": "",
    "(,|and|but) (any|either|whichever|whatever) [one|of them] (works|goes|<will> <enough>|is (fine|okay|good)) [with me|by me|for me] <edge>": "",
    "of your [own] (choice|choosing|liking|preference)": "",
    "rather {text} than {_place} <end>": "rather {text}",
    "<start> neither! {thing} nor! {thing2} [:|,] [but]": "do not touch {thing} and {thing2} .",
    "<start> [no!] not {one} (,|.|!|;) [but] {_one2} (!|.|;) {VERB} {that}": "do not touch {one} . {VERB} {that}",
    "<start> not! {one} (,|.|!|;|:) [but] {VERB} the other (one|{_NOUN})": "leave {one} alone . {VERB} the other one",
    "<start> not! {one} (,|.|!|;|:) [but] the other (one|{_NOUN})": "leave {one} alone . the other one",
    "<start> not! {_one} (,|.|!|;) [but] {one}": "{one}",
    "(two!|three!|these|some) (things|items|objects) for {container} : [first!] {thing} , [and] [then] {thing2} <end>": "put {thing} in {container} , then put {thing2} in {container}",
    "(two!|three!|these|some) (things|items|objects) for {container} : {thing} <end>": "put {thing} in {container}",
    "(no|wait|oh) [,] [actually] (leave|forget|skip|drop) (it|that) [there|alone] (,|.|and)": "no ,",
    "(everything|anything|all|those|things) {_words} , <namely> {thing} ,": "{thing}",
    "{_many} , <namely> {thing} ,": "{thing}",
    "(,|.) (shall we|will you|would you|could you|can you|okay|yeah|yes|huh|deal|understood|got it) <end>": "",
    ", you [will|would] (have|need) to open (it|that) (first!|before!|beforehand) <edge>": "",
    "{thing} {particle:up|down|out} (a moment|a minute|a sec|briefly) <edge>": "{thing} {particle}",
    "{thing} (a moment|a second!|a sec|briefly|momentarily) <edge>": "{thing}",
}
# fmt: on
OPENED = Constructions(DRAWERS, parts=PARTS)
"""Tried before the idioms: "yank" alone pulls, "yank the drawer open" opens."""
WORDINGS = Constructions(SHORTHAND, ORDERS, ENDS, ASIDES, parts=PARTS)


def in_plain_words(said: Said) -> Said:
    """Return a sentence with what has a plainer wording in that wording; the same sentence if there is none."""
    said = OPENED.reworded(said)
    return WORDINGS.reworded(said.now(plainly(said.tokens)))
