"""Other wordings of what the grammar knows, each with the plainer words for it.

They are tried, in this order, on sentences that the grammar did not understand as they stand. `template` says how a
pattern reads and what it may leave out. Each is here since many sentences need it, and not one.
"""

from __future__ import annotations

from robosandbox.agent.language import abroad
from robosandbox.agent.language.template import Constructions

# fmt: off
PARTS = {
    "time": "(noon|midday|midnight|lunchtime|lunch|dinnertime|dinner|teatime|closing (time|<edge>)|opening (time|<edge>)|the end of [the] (day|shift|week)|tonight|tomorrow|monday|tuesday|wednesday|thursday|friday|saturday|sunday|the morning|bedtime|breakfast)",
    "we": "(i|we)",
    "mark": "(,|.|;|!|:)",
    "belongs": "(belongs|belong|lives|live|goes|go|is kept|are kept)",
    "left_out": "{except:except|except for|apart from|but not|not|bar|save|other than}",
    "that_one": "(that one|this one|it|that|those|them|they|which)",
    "there": "[exactly|right|just] [put|there|here|where (it|they) (is|are)|as (it|they) (is|are)|on the table|in (its|their) (place|places)]",
    "anyone": "(<who>|{_person}|{_name}|she|he|they|everyone|everybody|someone|somebody|head office|management|the others)",
    "who": "(my|our|the|your|this|that) ({_person}|{_name}|{_name} {_person})",
    "wants": "(wants|want|needs|need|would like|would love|would prefer|asked for|asks for|prefers|likes|requires|requested|has requested|has asked for|fancies|is asking for|is after!|is waiting for)",
    "modal": "(would|could|can|will|should|must|ought to|has to|have to|had better|is to|are to|is supposed to|are supposed to|would love to|would rather|would prefer to|is meant to|are meant to|wants to|want to|needs to|need to|deserves to|likes to|would like to)",
    "be": "(be|go|sit|stand|live|lie|rest|look|feel|do|fit|work|come|belong|stay|end up|come to rest|move) [being|sitting|standing|lying|going|living|put|placed|kept|stored|moved|displayed|exhibited|shown|presented|positioned|parked|located|situated|arranged|housed|stationed]",
    "adverb": "[just|really|actually|probably|now|all|definitely|certainly|surely|normally|usually|always|ideally|well] [as well]",
    "wait": "(no|wait|hang on|hold on|sorry|oops|actually|hmm)",
    "shove": "(shove|biff|hoy|yeet|bosh|jam|ram|lump|wang|lash|squeeze|park)",
    "wants2": "(wants|want|needs|need|would like|would love|would prefer|asked for|asks for)",
    "theirs": "(the [other] other|each other|one another|the others)",
    "takes": "(takes|take|gets|get|has|have|ends up in|end up in|goes to|go to)",
    "will": "(will|would|should|must|can|could|ought to)",
    "stands": "(is|are|stands|stand|sits|sit|goes|go|lies|lie|ends up|end up|comes|come)",
    "enough": "(do|suffice|be (enough|plenty|sufficient|fine|good|okay|right|perfect)) [it|nicely|the trick|for me]",
}
TABLE = {
    "<edge> (trust me|believe me|mark my words|hear me out|bear with me|fair enough|i swear|i promise|anyway|anyhow|in case you (forgot|did not! know|were wondering)|(can|would|will) you believe (it|that)|what was i saying|where was i|hop to it|look lively) [and|,|but]": "",
    "<start> [my|the|our] {_person} (said|says|asked|told) [me|you|us|that] [to|:|,] {VERB}": "{VERB}",
    "(while!|whilst|when!|since) you (are|have) [got] [about|around|over|up] (at it|there|here|on|finished)": "",
    "(whatever|no! matter what) (you do|happens|anyone says|else! you do) [,]": "",
    "by <time> [at the latest|latest|sharp|please]": "",
    "(today|this (morning|afternoon|evening|instant|week)|these days|nowadays|at the moment|for (today|the day|a change|a wash|safety|once!|safe keeping|safekeeping|good luck|now)) <edge>": "",
    "<mark> [and] <we> do not! (mind|care) (which|whichever) [one|ones|way|side|two!|three!|of (them|those|these)] [(you (take|choose|pick|use|tap|move|put|do|start with)|comes|goes|is|gets (done|tapped|moved)) [first!|last!]] <edge>": "",
    "<verb> [make|give|do] {n:two|three|four|2.0|3.0|4.0} (taps|touches) (on|to|at|for|of) {thing}": "tap {thing} {n} times",
    "<start> {_VERB=tap} (test|order|sequence|check|list|all of these|the following|these) [,] [in [the|this] [following|given|listed] (order|sequence)] (:|,) {thing}": "tap {thing}",
    "<start> {_VERB=tap} [,] [in [the|this] [following|given|listed] (order|sequence)] : {thing}": "tap {thing}",
    "(,|.|;) {place} (i mean|i meant|rather) <end>": ", no , {place}",
    "(,|.|;) [oh|no|wait] actually [,] (leave|forget|skip|drop) (it|that|that one) (,|.|and)": ", no ,",
    "[and|,] [and|but] [then|so] [please|just] [you (can|may|could|should|might)] [just|then] (leave|keep) (it|{_drawer}) [wide] open [again!|after!|afterwards|for now|when! done] <edge>": "",
    "<verb> {VERB} {many} , namelyonly {one} <end>": "of {many} , {VERB} {one}",
    "{cup:mug|cup|jar|bowl|glass|jug|vial|beaker|pot|tin|pitcher|tumbler} with the {word} (and|,|<end>)": "{cup} with {word} in it ,",
    "<edge> {thing} <belongs> {place} [,|;|.] [and|so|please] (put|tidy|clear|stow|pack|take|move|bring|get|stash) {_PRON} (away|back|home|where (it|they) <belongs>) <edge>": "put {thing} {place}",
    "<left_out> {thing} , [and] <that_one> (stays|stay|remains|remain|(can|should|must|may|has to|have to|is to|are to) (stay|remain)) <there> <end>": "{except} {thing}",
    "<verb> {_VERB=push} {thing} , {way}": "push {thing} {way}",
    "and nothing! else! {place} <end>": "{place}",
    "[and|,] [and|then] {VERB=close} {thing} (when!|once!|after!) (it|they|both|all of them|everything) (is|are) [all|safely|both] (in|inside|in there|in it|in place)": ", then {VERB=close} {thing}",
    "<edge> {thing} (belong|belongs|goes|go|should be|should go|must go|need to be|needs to be) {place} , [so] [please|can you|could you|would you] [please] (put|place|drop|move) (it|them) (there|in there|in it) <end>": "put {thing} {place}",
    "[and|,|.|;] after! that [,]": ", then",
    "<edge> {one} , {goes:goes|belongs} {place}": "{one} {goes} {place}",
    "(the|an|my|your) , {word}": "the {word}",
    "<verb> roll {thing} {way}": "push {thing} {way}",
    "<verb> (keep|hold) (it|them|that) (in the air|up|aloft|raised|lifted|up in the air|off the table|up high|there|steady|still!|tight|tightly|for me|up for me|up for a moment) <end>": "hold it",
    "<verb> (keep hold of|keep a hold of|keep holding|keep holding on to) (it|them|that) [in the air|up|there|steady|still!|tight|tightly|for me|for a moment] <end>": "hold it",
    "<edge> for {thing} (,|:) {VERB} (it|them)": "{VERB} {thing}",
    "<verb> use {holder} for {thing} <end>": "put {thing} in {holder}",
    "<edge> <anyone> [really|also|just] <wants> {thing} {place}": "{thing} {place}",
    "<edge> {thing} (does|do|did|should|must|can|could|is|are|ought) not! [really|to|supposed to|meant to] [be] (go|belong|live|sit|stand|stay|be|lie|left|lying|sitting|standing|here|there) [being|left|lying|sitting|standing] [{_words}] (,|.|;|!) [but|so|and] (it|they) (<belongs>|<modal> <be>)": "{thing} goes",
    "<edge> {thing} <adverb> <modal> <adverb> <be> {place}": "{thing} goes {place}",
    "<start> {one} (<belongs>|<modal> <be>) (in|into|to) {holder} <end>": "put {one} in {holder}",
    "<edge> {it:it|that|they} (<belongs>|<modal> <be>) (in|into|to) {holder} <end>": "put {it} in {holder}",
    "<wait> [,] [oh|no|wait] [,] (it|that|this|they) (is|are|was|will|would|does|might|could|can) [not!] {_words} , [but]": "no ,",
    "(no|wait|oh|sorry) [,|:] [wait|hang on|hold on|sorry] [,] (no|wait|actually) (:|,)": "no ,",
    "[about|around|roughly|approximately|pretty much|right|exactly] (halfway|midway|half! way) [in] between": "between",
    "(to the|on the) {side:left|right} of {one} [,] {distance} (away [from it]|apart|off|from it)": "{distance} to the {side} of {one}",
    "{side:in front of|behind} {one} [,] {distance} (away [from it]|apart|off|from it|<edge>)": "{distance} {side} {one}",
    "used to (be|stand|sit|lie)": "was",
    "<edge> (i|we) do not! (want|need|like) {that} (there|over there|where it is) [any more|anymore|now] (,|;|.|:|so|and) [so|and]": "{that} ,",
    "<verb> (give|do|have|take|make|perform|i want|i need|i would like) [me|us] {_A} [{_LIGHT_ADJECTIVE}] {LIGHT_NOUN} (of|to|on|for|at) {thing}": "{LIGHT_NOUN} {thing}",
    "<edge> {thing} (needs|need|wants|want|requires|require|deserves) {doing}": "start {doing} {thing}",
    "<verb> make that {thing} (is|are|goes|go|comes) {place}": "i want {thing} {place}",
    "<verb> <shove> {thing} {into:in|into|inside|on|onto|on top of} {one} <edge>": "put {thing} {into} {one}",
    "<verb> (lift|raise|hoist) {thing} [up|over|across] {onto:into|onto|to|on to|over to|across to|in to|over into|over onto|up onto|up on|on top of} {one} <edge>": "put {thing} {onto} {one}",
    "<edge> {thing} you (put|place) {place} <end>": "put {thing} {place}",
    "<edge> {thing} , {place} {VERB} {_PRON} <edge>": "{VERB} {thing} {place}",
    "(i|we) <wants2> that {thing} (go|goes|come|comes|is|be|gets|lands|ends up) {place}": "i want {thing} {place}",
    "<edge> {thing} (lives|live|belongs|belong|goes|go|is kept|are kept) {place} [,|;|.] [and|so] (put|stick|pop|place|drop) {_PRON} [in|back] there": "put {thing} {place}",
    "{VERB=swap} {thing} [,] [and] [so|such] [that] (each|each one|each of them|both|they|the one|one|every one) [now|then] (<takes> the place of the other [one]|<takes> <theirs> place|(<stands>|<will> (be|stand|sit|go|lie|end up)) where the other [one] [currently] (is|was|stands|stood|sits|sat|lies|lay) [now|before!]) <end>": "{VERB=swap} {thing}",
    "{distance} [,] [that] (<will> <enough>|(is|are) (enough|plenty|sufficient|fine)|suffices) <edge>": "{distance}",
    "<start> [no!] not {one} (,|.|!|;) [but] {_one2} (!|.|;) {VERB} {that}": "do not touch {one} . {VERB} {that}",
}
# fmt: on
WORDINGS = Constructions(abroad.ASIDES_ABROAD, abroad.FOREIGN, TABLE, parts={**abroad.PARTS, **PARTS})
