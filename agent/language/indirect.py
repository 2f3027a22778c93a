"""Indirect orders: what belongs where, what would be better, what somebody wants; and formulas that mean nothing.

Tried first on sentences that the grammar did not understand as they stand: formulas go, then clauses that only tell of
something (`incidental`), then what is left is said as a plain order. `template` says how a pattern reads.
"""

from __future__ import annotations

from robosandbox.agent.language import colloquial
from robosandbox.agent.language.abroad import ABROAD, ASIDES_ABROAD
from robosandbox.agent.language.compound import COMPOUND
from robosandbox.agent.language.courtesies import POLITE
from robosandbox.agent.language.incidental import without_incidentals
from robosandbox.agent.language.initials import in_full
from robosandbox.agent.language.numbering import by_number
from robosandbox.agent.language.ordering import in_order
from robosandbox.agent.language.pairing import pairwise_told
from robosandbox.agent.language.referring import told_again
from robosandbox.agent.language.slots import Said
from robosandbox.agent.language.template import Constructions
from robosandbox.agent.language.terse import TERSE

# fmt: off
PARTS = {
    "we": "(i|we)",
    "modal": "(would|could|can|will|should|must|ought to|has to|have to|had better|is to|are to|is supposed to|are supposed to|would love to|would rather|would prefer to|is meant to|are meant to|wants to|want to|needs to|need to|deserves to|likes to|would like to)",
    "adverb": "[just|really|actually|probably|now|all|definitely|certainly|surely|normally|usually|always|ideally|well] [as well]",
    "be": "(be|go|sit|stand|live|lie|rest|look|feel|do|fit|work|come|belong|stay|end up|come to rest|move) [being|sitting|standing|lying|going|living|put|placed|kept|stored|moved|displayed|exhibited|shown|presented|positioned|parked|located|situated|arranged|housed|stationed]",
    "better": "[so|much|far|a lot|way|a bit|rather|even] (better off|better|best|nicer|nice|good|great|safer|happier|nicely|perfectly|lovely|fine|tidier|neater|handier|more useful|more at home|at home|right at home)",
    "belongs": "(belongs|belong|lives|live|goes|go|is kept|are kept)",
    "it": "(it|that|this|they)",
    "is": "(is|are|was|were|will be|would be|would)",
    "wait": "(no|wait|hang on|hold on|sorry|oops|actually|hmm)",
    "mark": "(,|.|;|!|:)",
    "trouble": "(trouble|bother|hassle|work|to ask|a problem|an ask|hard|difficult|tricky|fiddly|awkward|a nuisance|a pain|an imposition|inconvenient|cheeky|rude|annoying|fussy)",
    "fine": "(great|brilliant|ace|lovely|perfect|fab|fabulous|grand|super|wonderful|amazing|awesome|smashing|nice|good|ideal|the best|a big help|a great help|a help|a lifesaver|helpful|fantastic|magic|marvellous|cool|fine|much appreciated|appreciated|so kind|very kind|kind of you|a treat|a dream|the dream)",
    "time": "(noon|midday|midnight|lunchtime|lunch|dinnertime|dinner|teatime|closing (time|<edge>)|opening (time|<edge>)|the end of [the] (day|shift|week)|tonight|tomorrow|monday|tuesday|wednesday|thursday|friday|saturday|sunday|the morning|bedtime|breakfast)",
    "will_do": "((will|would|should|ought to|can) (do|be (fine|okay|good|perfect|enough))|works|is (fine|okay|good|perfect)) [nicely|fine|well|just fine|perfectly|for (that|it|them|this)]",
    "done": "(done|good|sorted|set|finished|golden|happy|laughing|all set|all good|all done|off|away|home and dry|ready|in business)",
    "who": "(my|our|the|your|this|that) ({_person}|{_name}|{_name} {_person})",
    "anyone": "(<who>|{_person}|{_name}|she|he|they|everyone|everybody|someone|somebody|head office|management|the others)",
    "wants": "(wants|want|needs|need|would like|would love|would prefer|asked for|asks for|prefers|likes|requires|requested|has requested|has asked for|fancies|is asking for|is after!|is waiting for)",
}
FORMULAS = {
    "<edge> (trust me|believe me|mark my words|hear me out|bear with me|fair enough|i swear|i promise|anyway|anyhow|in case you (forgot|did not! know|were wondering)|(can|would|will) you believe (it|that)|what was i saying|where was i|hop to it|look lively) [and|,|but]": "",
    "<start> (how about|what about|why do not!|what do you say) (we|you|i) {VERB}": "{VERB}",
    "<start> what (we|you|i) do is [we|you|to|i]": "",
    "there is {thing} (somewhere|about|around|around here|lying about|lying around)": "there is {thing}",
    ", any {_NOUN} [will do|at all] ,": "",
    "<start> [my|the|our] {_person} (said|says|asked|told) [me|you|us|that] [to|:|,] {VERB}": "{VERB}",
    "<edge> {one} (it|they) {is:is|are|has|was|does|must|should|goes}": "{one} {is}",
    "(,|.|!|;) [please|so|now] (do (it|that)|make it so|make (it|that) happen|get it done|get to it|see to it) [now|for me] <end>": "",
    "(exactly|precisely|strictly) <end>": "",
    "<edge> if! {thing} (could|can|would|might|were to|was to) <be> {place} [,] (it|that|this) (would|will) {_praise} <edge>": "{thing} goes {place}",
    "(probably|obviously|of course|naturally|apparently|seriously|personally|frankly|clearly)": "",
    ", no! need to (rush|hurry|worry|panic|be (gentle|careful|shy|quick)|explain|ask|apologise|thank me) <edge>": "",
    "for (luck|good luck|fun|a laugh|kicks|show|effect|good measure|old times sake)": "",
    "<edge> (go on|go for it|off you go|away you go|there is a (love|dear|good lad|good girl)|up you go) <end>": "",
    "<edge> you are (a|an|the|my|so|too|such a) [{_word}] [{_word2}] {_word3} <edge>": "",
    "(and|,) (be done [with it]|get it over with|that is that|leave it at that|let that be it|then rest)": "",
    "as far as (<we> (am|are)|that is|it is) concerned": "",
    "(sorry|i hate|not! wanting|i do not! mean) to be (a|such a) (pain|nuisance|bother|pest|nag|fusspot) [,] [but]": "",
    "to be (a|such a) (pain|nuisance|bother|pest|nag|fusspot) [,] [but]": "",
    "<edge> [and|but|well] (to be|in all) (honest|fair|frank|precise|exact|sure|on the safe side|safe|clear|honesty|fairness) [with you] <edge>": "",
    "to be (honest|fair|frank|quite honest|perfectly honest|totally honest) [with you]": "",
    "[quick] as (you (like|please)|lightning|a flash)": "",
    "(quick|fast|soon!|quickly|easy|careful|gentle|gently|tidy|neat|calm|cool|nice) as (you (like|can|please|want)|anything|possible|a flash|lightning)": "",
    "as (quick|fast|soon!|quickly|neatly|gently|carefully|tidily) as (you (like|can|please|want|are able)|possible|ever)": "",
    "(as|so) far as <we> (remember|know|can (tell|see|remember|recall)|recall|am aware|are aware)": "",
    "if! (<we> (remember|recall) [it|that] [right|rightly|correctly|well]|<we> (am|are) not! mistaken|you ask (me|us)|memory serves|you (know|see|get|catch) what <we> mean|you (get|catch) my (drift|meaning)|you follow me|<we> may say so|i may|you must know|truth be told|it (was|were) up to me)": "",
    "(as|like) (you know|you can see|you see|<we> (said|mentioned)|mentioned|ever|per usual|you do|always|before!|per normal|normal|promised)": "",
    "<edge> [please] do not! (ask|tell|blame|quote|judge|worry|laugh|get me wrong|mind|hate|shout|hurry|stress|fret|panic|be shy|be long|dawdle|hang about|take too long|take long|be silly) [me|us|at me|on me|on that|about that|about it] [why|how|on that|yet!] <edge>": "",
    "[what is|what was|whats] (it|that|this|he|she) (called|name|again!) [again!] <edge>": "",
    "what (do|did|would|should) (you|we|they|i|one) call (it|that|them) [again!] <edge>": "",
    "(what is|what was) [the|its|that] (word|name|it) [again!|for it] <edge>": "",
    "(whatsit|thingummy|thingamajig|whatchamacallit|thingy|doodah) ,": "",
    "(i|we) (dunno|do not! (know|mind|remember|care)|am not! (sure|certain)|forget|reckon|guess|suppose|believe|think|imagine|would (say|think|guess)|mean to say) <edge>": "",
    "(would|do|is|are|does|will|can|could|should|has|have|did|was|might) not! (you|it|they|we|i|he|she|that|there) [think|agree|reckon|say] <end>": "",
    "[,] (would|will|could|can|do) you [mind|be (able|so kind|a love|a dear|willing|up for it)|do (that|it|so) [for me|for us]|manage that|please|kindly] [kindly] <end>": "",
    "(while!|whilst|when!|since) you (are|have) [got] [about|around|over|up] (at it|there|here|on|finished)": "",
    "while! you (are|have) [got] [about|around|over|up] (at it|there|here|on)": "",
    "(whatever|no! matter what) (you do|happens|anyone says|else! you do) [,]": "",
    "not! that (it matters|i (am|care|mind)|we (are|care|mind)|it is) {_words} (but|,)": "",
    "not! (to|that i want to) be (fussy|picky|rude|difficult|a pain|funny|bossy|pushy) (but|,)": "",
    "after! all <edge>": "",
    "if! (it|that|this) is not! [too|very|really|so|that] [much] [of] [a|an] <trouble> [for you]": "",
    "if! (it|that|this) is (not! too (late|busy)|not! [too|very|that] (bold|boring|complicated|demanding|inconvenient|much [of an effort]|silly|tedious|tiring)|no! <trouble>|all right|alright|okay|ok|fine|possible|convenient|allowed) [with you|by you|for you] <edge>": "",
    "(if!|when!|whenever!|once!) you (get|got|have|have got|find|can find|can spare|could spare|catch) [a|some|any|the] (minute|moment|sec|time|chance|spare minute|spare moment|free moment|free minute|free hand|hand free|breather|tick|jiffy|mo) [free|spare|to spare|for me]": "",
    "(if!|when!|whenever!|once!) you (are|feel) (free|ready|up (to|for) it|able|around|available|awake|so inclined|in the mood|not! (too|very|otherwise!) (busy|tired|fussed|bothered|occupied))": "",
    "if! you (fancy|fancied|feel like) (it|that)": "",
    "if! you (can|could|would|will|want to|are able to|would like to|manage|can manage it|can manage to|know how) <edge>": "",
    "[if! you (can|could|would) ,] (it|that|this|which) (would|will|is|ought to|should) [just|really|have been|make me] [be] [really|so|very|just|a|absolutely|totally] <fine> [of you|for me|for us] <edge>": "",
    "[and|,] [then|so] (we|i) (are|will be|am|would be) [all] <done> [here|for (now|today)|then] <end>": "",
    "<mark> [and] [then] [the] (job|all|jobs|work|mission|task|that|game) (done|a good one|sorted|over|complete|accomplished|finished|set) <end>": "",
    "<mark> (job done|jobs a good un|sorted|happy days|easy peasy|no! (biggie|pressure|drama|fuss|big deal|stress|sweat|hurry)|lovely jubbly|nice one|good stuff|great stuff|end|finish|finito|over|full stop|done and dusted|end of story|simple as that|simples|piece of cake|bish bash bosh|voila|ta da|tada|there we (go|are)|and (done|bob is your uncle|hey presto)) <end>": "",
    "by <time> [at the latest|latest|sharp|please]": "",
    "(today|this (morning|afternoon|evening|instant|week)|these days|nowadays|at the moment|for (today|the day|a change|a wash|safety|once!|safe keeping|safekeeping|good luck|now)) <edge>": "",
    "(which|what) (one|ones|two!|three!|of them|order|way|side) [of them] (is|are) (up to you|your (choice|call|decision)|not! important|no! matter)": "",
    "<mark> [it is|that is|totally|all] (your (call|choice|pick)|up to you|you choose|you decide|dealer choice) [where|how|which [one|ones|way|side|two!|three!|of (them|those|these)]] <edge>": "",
    "<mark> [and] (it|that) (does not!|makes no!) (matter|difference) (which|whichever) [one|ones|way|side|two!|three!|of (them|those|these)] [(you (take|choose|pick|use|tap|move|put|do|start with)|comes|goes|is|gets (done|tapped|moved)) [first!|last!]] <edge>": "",
    "<mark> [and] <we> do not! (mind|care) (which|whichever) [one|ones|way|side|two!|three!|of (them|those|these)] [(you (take|choose|pick|use|tap|move|put|do|start with)|comes|goes|is|gets (done|tapped|moved)) [first!|last!]] <edge>": "",
    "before! (it|that|this|he|she|they|someone|somebody|anyone|anybody|i|we) {_words} (again!|over it|on it|with it|of it|it) <edge>": "",
    "[in order] (to|so as to) (wake|cheer|help|please|impress|warm|scare|test|entertain|surprise|tease|calm) (it|me|us|them|him|her) [{_word}] [{_word2}] <edge>": "",
    "<start> (but|and|anyway) [,]": "",
}
FOREIGN = {
    # As those say it who have it from another language, or are small.
    "<verb> [put|bring|get|move|take|go] [back] yourself [back] (in|to|at|into) [the|your] (start|starting|home|initial|rest|resting|base) (position|pose|place|point|spot)": "go home",
    "(to|towards|toward) the (far|other|opposite) side (from|of) (you|the robot|the arm)": "away from you",
    "more near [to]": "nearer to",
    "the both": "both",
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
    "before to {VERB}": "before you {VERB}",
    "<verb> (put|place|drop) (in|into) (it|there) {thing}": "put {thing} in it",
    "<start> {thing} (i|we) (want|would like|need|wish|prefer) [to have|to be] {place}": "i want {thing} {place}",
    "<verb> (clear|get|move|take|shift|put) {thing} out of (my|our|the) way , (in|into) {one} with (it|them)": "put {thing} in {one}",
    "out of (my|our) way": "out of the way",
    "<start> [i (said|meant|mean|want)] {one} [,] [and] not! {_one2} (,|.|!) {VERB} {_PRON}": "{VERB} {one}",
    "not! {_place} [,] [and|or!|nor!] [also] (not!|nor!) {_place2} [,] but [only!] {place}": "{place}",
    "<start> {thing} {place} first! (.|,|;|!) [and] [only!] then": "{thing} {place} , then",
    "{VERB=tap} {thing} once! [each] [,]": "{VERB=tap} {thing}",
    "<verb> (put|place|stack|set) {one} on {one2} [,|.|and|then] [then|and] (on top of|on) (that|it|this|top) [goes|comes|put|place|you put] {thing}": "put {one} on {one2} , then put {thing} on {one}",
    "{word} what {is:is|are} {SUPER}": "{word} that {is} {SUPER}",
    "(to|at|in|on) [the] behind of {one}": "behind {one}",
    "{near:behind|beside|underneath|under|near} (of|from|to) {one}": "{near} {one}",
    "(inside|within) (of|from|to|in) {one}": "in {one}",
    "(to|at|in) between of": "between",
    "{one} inside (put|place|drop) <edge>": "in {one} put",
    "<edge> {distance} (to|at) {forward:forward|forwards|backward|backwards}": "{forward} {distance}",
    "<verb> {_VERB=push} {thing} for {distance}": "push {thing} {distance}",
    "<verb> {_VERB=move} {thing} for {distance}": "push {thing} {distance}",
    "<verb> {_VERB=push} {thing} to {way} for {distance}": "push {thing} {way} {distance}",
    "<verb> {_VERB=push} {thing} to {way}": "push {thing} {way}",
    "(to|the) {forward:forward|forwards|backward|backwards}": "{forward}",
    "<verb> give {thing} {adj:little|small|tiny|quick|gentle|light|soft|big|good} {LIGHT_NOUN}": "give {thing} a {adj} {LIGHT_NOUN}",
    "{thing} (little|small|tiny) bit": "{thing} a little bit",
    "<we> (want|need|would like|wish|prefer|would love|require) [that] you [to|should|will|can|could] {VERB}": "{VERB}",
    "<edge> it (must|should|has to|needs to|have to) {VERB} {thing}": "{VERB} {thing}",
    "<edge> (please|kindly) be {doing}": "start {doing}",
    "<start> [do] be {doing} {thing}": "start {doing} {thing}",
    "{place} to (put|place|move|bring|set) <edge>": "{place} put",
    "<edge> {thing} , {place} (put|place) <edge>": "put {thing} {place}",
    "<verb> {open:open|close|shut} {thing} (good|well|complete|completely|fully|wide|tight|tightly|all the way|properly|firmly|all) <edge>": "{open} {thing}",
    "<mark> (after!|afterwards|later!) {VERB} {PRON} <edge>": ", then {VERB} {PRON}",
    "open {drawer} (,|and|then) [and|then] (put|place|drop) (there|inside) {thing}": "open {drawer} , put {thing} in it",
    "<edge> {thing} (must|should|have to|has to|need to|needs to) (change|switch|exchange|trade|swap) [their|the] (places|place|positions|spots)": "swap {thing}",
    "remaining {many:two|three|four}": "the other {many}",
    "{NOUN} {COLOUR} {size:small|little|big|large|tiny} {go:go|goes|must|should|has|have|in|on|into|onto|to|is|are|,|and|next|near|beside|.|;}": "{size} {COLOUR} {NOUN} {go}",
    "<verb> {put:put|set|place|lay} {thing} back down {distance} {way}": "{put} {thing} down {distance} {way}",
    "{NOUN} {COLOUR} {size:small|little|big|large|tiny} <end>": "{size} {COLOUR} {NOUN}",
    "(from|of) where (it|they) (is|are|stands|sits) [now|right now|currently|at the moment]": "",
}
INDIRECT = {
    "<edge> [and|so] if! you (can|could|would|might|will) [just|please|maybe|kindly|possibly|quickly] {VERB} {thing}": "{VERB} {thing}",
    "<start> (me and {_name}|{_name} and (me|i)) <wants> {thing}": "i want {thing}",
    # Who wants it, and how it is thought or said, makes no difference.
    "<edge> (i|we) (was|were|am|are|have been|had been|would be|do|did|would|will) [just|kind of|sort of|really] (thinking|hoping|wondering|think|hope|reckon|suppose|guess|imagine|say|expect|believe|wishing) [that|if!|whether!|maybe|perhaps] {that} <modal>": "{that} should",
    "<edge> (i|we|mum|mom|dad|<who>) (think|thinks|reckon|reckons|suppose|guess|believe|feel|hope|say|says|suggest|figure|figures) [that|maybe|perhaps] {thing} <modal>": "{thing} should",
    "<edge> (i|we|<who>) (think|thinks|reckon|reckons|suppose|guess|believe|feel|hope|say|says|suggest|figure|figures) [that|maybe|perhaps] {thing} <belongs>": "{thing} goes",
    "(would|will|is|was|might) (it|that) [be] [too|really|very|at all|awfully|much|so|terribly] [much] [of] [a|an] (<trouble>|{_praise}|possible|okay|ok|all right|alright) (to|for you to|if! you (could|would|can|were to|will)) {VERB}": "could you {VERB}",
    "<we> (would|will) {_praise} if! {thing} (was|were|is|are|went|go|goes|sat|stood|lay|could (be|go|sit|stand)|had been|got put|got) [put|placed|moved|sitting|standing|lying] {place}": "i want {thing} {place}",
    "(it|that|things) (would|will) {_praise} if! {thing} (was|were|is|are|went|go|goes|sat|stood|lay|could (be|go|sit|stand)|had been|got put|got) [put|placed|moved|sitting|standing|lying] {place}": "i want {thing} {place}",
    "[and|,] if! <we> (could|can|may|might) [just|please|maybe] (have|get|see|ask for) {thing} {place}": "{thing} {place}",
    "<edge> <anyone> [really|also|just] <wants> {thing} {place}": "{thing} {place}",
    "<edge> <anyone> [really|also|just] <wants> {thing} (to be|to go|to sit|to stand|to live|to end up|put|placed|moved|sitting|standing|kept) {place}": "{thing} {place}",
    "<edge> <anyone> [also|just] <wants> {that} (open|opened)": "open {that}",
    "[and] <anyone> [also|just] <wants> {thing} (shut|closed|closed up) [again!|after!|afterwards|as well|too]": "close {thing}",
    "<edge> (i|we) (could|can|would|will|might|may|am going to|are going to) [really|totally|definitely|desperately|probably|just|so|actually] (use|need|do with|go for|be needing|be wanting|require|want|have use for|have need of) {that} <edge>": "pick up {that}",
    "<edge> (i|we) have [a] need (of|for) {that} <edge>": "pick up {that}",
    "<edge> (i|we) (am|are) (wanting|needing|after!|wishing) {thing}": "i want {thing}",
    # Where it is, is not where it belongs.
    "<edge> {thing} (does|do|did|should|must|can|could|is|are|ought) not! [really|to|supposed to|meant to] [be] (go|belong|live|sit|stand|stay|be|lie|left|lying|sitting|standing|here|there) [being|left|lying|sitting|standing] [{_words}] (,|.|;|!) [but|so|and] [please] {VERB} {PRON}": "{thing} , {VERB} {PRON}",
    "<edge> {thing} (does|do|did|should|must|can|could|is|are|ought) not! [really|to|supposed to|meant to] [be] (go|belong|live|sit|stand|stay|be|lie|left|lying|sitting|standing|here|there) [being|left|lying|sitting|standing] [{_words}] (,|.|;|!) [but|so|and] (it|they) (<belongs>|<modal> <be>)": "{thing} goes",
    "<edge> not! {_one} for {thing} [,] [sorry|no!|wait] [,] <we> (would|want|need) [rather|prefer|like|to] [have] it {place}": "{thing} {place}",
    "<edge> {one} (is|are) (in|at|on) [a|the|its] wrong (place|spot|position|side) , [but|so] (its|their) (place|spot|home) is [in|at|on] {one2}": "put {one} in {one2}",
    # Where it would be better, might as well be, could do with being.
    "<edge> {thing} <adverb> <modal> <adverb> <be> <better> {place}": "{thing} goes {place}",
    "<edge> {thing} <adverb> <modal> <adverb> <be> {place}": "{thing} goes {place}",
    "<edge> {thing} (might|may) <adverb> [be] <better> {place}": "{thing} goes {place}",
    "<edge> {thing} (might|may) [just] [as well] (go|sit|stand|live|rest|come|move|end up) {place}": "{thing} goes {place}",
    "<edge> {thing} (might|may) [just] as well be {place}": "{thing} goes {place}",
    "<edge> {thing} (could|can|might) do with [a bit of] [being|going|standing|sitting|lying|living|resting] [put|placed|moved|over] {place}": "{thing} goes {place}",
    "<edge> {thing} (really|actually|probably|definitely|surely|usually|normally|always|obviously|rightfully|properly) <belongs> {place}": "{thing} goes {place}",
    "<edge> {thing} <belongs> {place} (really|actually|of course|obviously|normally|usually|right) <edge>": "{thing} goes {place}",
    "<edge> {holder} (can have|could have|may have|should have|can take|could take|gets|has|takes|wants|needs|is waiting for) {thing}": "put {thing} in {holder}",
    "<edge> {thing} (is|are) [now|really|all] [one|something|ones] (for|bound for|destined for|off to|going to|headed for|heading for|ready for|due in) {holder}": "put {thing} in {holder}",
    "<start> {thing} (is|are|looks|look|goes|go|went|has|have|was|were) [all|very|so|too|completely|no!|out|gone] {_word} [{_word2}] (, so|,|so) {holder} <end>": "put {thing} in {holder}",
    "<edge> [and] (fetch|get|grab|bring|find) {thing} for {holder} <edge>": "put {thing} in {holder}",
    "<start> {thing} , {holder} [it is|with (it|them|that|the lot)] <end>": "put {thing} in {holder}",
    "<edge> (that|this|it) is [one|something] (for|bound for|destined for|off to) {holder}": "put it in {holder}",
    "<edge> {thing} <belongs> {place} [,] [and|so] [in|on|back|there|that is where] [there] (it|they) <belongs>": "{thing} goes {place}",
    "<edge> <anyone> [normally|usually|always] (keeps|keep|puts|put|leaves|leave|has|stores|parks|stands) {thing} {place} [,|;|.] [so|and] [let us] [please] {_VERB} (it|them|that) [right] [back] (there|in there|on there)": "put {thing} {place}",
    "<start> (should|would|could|ought) not! {thing} [really|actually] <be> {place}": "{thing} goes {place}",
    "<edge> {thing} (deserves|needs|wants|has earned|could use|should have|gets) [a|its|the|some] [new|proper|own|nice] (spot|place|home|seat|room|perch|bed) {place}": "{thing} goes {place}",
    "<edge> (i|we) (fancy|would fancy|am keen on|are keen on|vote for|vote) {thing} {place}": "{thing} {place}",
    "<start> {one} (<belongs>|<modal> <be>) (in|into|to) {holder} <end>": "put {one} in {holder}",
    "<edge> {it:it|that|they} (<belongs>|<modal> <be>) (in|into|to) {holder} <end>": "put {it} in {holder}",
    "<edge> (i|we) (do|did|will|would|can|am|are) not! [be] (need|needing|want|wanting|use|using|like) {thing} [any more|anymore|any longer|now|here] (,|.|;|so|!) {VERB} {PRON}": "{thing} , {VERB} {PRON}",
    "<edge> {place} (it|they) (goes|go) <edge>": "put it {place}",
    "<start> [oh|no!|sorry] i (said|meant|mean|want|am talking about|was talking about) {one} (,|.|!) {VERB} {_PRON}": "{VERB} {one}",
    "<edge> {thing} (could do with|need|needs|want|would benefit from|should be|could be|are to be) (swapping|switching|swapped|switched|exchanged) [places|round|around|over]": "swap {thing}",
    ", {holder} (is|would be|will be) (fine|ok|okay|good|perfect|best) <edge>": "in {holder}",
    ", {holder} (will do|would do|works) <edge>": "in {holder}",
    "<verb> {put:put|tidy|clear|pack|stow} {thing} away [,] [(all|both|each) [of (them|those|these)]] except {thing2} (.|;|!) {holder} <will_do> <end>": "{put} {thing} except {thing2} away in {holder}",
    "<verb> {put:put|tidy|clear|pack|stow} {thing} away (.|;|!) {holder} <will_do> <end>": "{put} {thing} away in {holder}",
    # What is poured is said by what it is for, or by what it is in.
    "<verb> give {one} (a|some|its|the) (drink|water|watering|shower|splash|refill|top up) (from|out of|with) {one2}": "pour {one2} into {one}",
    "<verb> (water|fill|refill|top up|fill up) {one} (from|out of) {one2}": "pour {one2} into {one}",
    "<verb> water {one} (with|using) {one2}": "pour {one2} into {one}",
    "<edge> (whatever|what|everything that|everything|anything) is [still!|left] (in|inside) {one} , {VERB=pour} (it|that|this|them) {place}": "{VERB=pour} {one} {place}",
    "<start> nothing! (but|except!|other than|besides) {thing} {goes:goes|go|belongs|belong|should go|must go} {place}": "only {thing} {goes} {place}",
    "<edge> it is {that} [that] (i|we) (am after!|want|need|meant|would like|am looking for|was thinking of) <edge>": "pick up {that}",
    # What was said wrong is set right at once.
    "<wait> [,] [oh|no|wait] [,] (it|that|this|they) (is|are|was|will|would|does|might|could|can) [not!] {_words} , [but]": "no ,",
    "<mark> [oh|hmm|no|wait] [,] [no|wait] [,] (that|it|this) (is|was|would be) [way|far|a bit|a little] [too] (much|far|little|short|long) (,|.|;) [just|only!|rather|make it|make that] {way}": ", no , {way}",
    "(no|wait|oh|sorry) [,|:] [wait|hang on|hold on|sorry] [,] (no|wait|actually) (:|,)": "no ,",
    ", {one} (i|we) (mean|meant|mean to say|meant to say) <edge>": ", i mean {one}",
    ", (that|this|the) one [there|over there|here] , (it|they)": "",
    "(the|a|an) , the": "the",
    "by , {distance}": "by {distance}",
    "(a good|a full|a solid|a whole|a mere|a clear) {distance}": "{distance}",
    "[about|around|roughly|approximately|pretty much|right|exactly] (halfway|midway|half! way) [in] between": "between",
}
# fmt: on
_PARTS = {**PARTS, **colloquial.PARTS}
_FORMULAS = Constructions(FORMULAS, ASIDES_ABROAD, TERSE, colloquial.FILLERS, parts=_PARTS)
_INDIRECT = Constructions(colloquial.CLAUSES, ABROAD, FOREIGN, INDIRECT, parts=_PARTS)


def plainly_asked(said: Said) -> Said:
    """Return a sentence without formulas and incidental clauses, its indirect orders said outright; the same if none."""
    return _INDIRECT.reworded(
        without_incidentals(
            _FORMULAS.reworded(
                POLITE.reworded(in_order(COMPOUND.reworded(told_again(pairwise_told(by_number(in_full(said)))))))
            )
        )
    )
