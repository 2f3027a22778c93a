"""Parts of long sentences that say when, with what, or what stays: each with the plainer words for it.

`template` says how a pattern reads. What only says that a step comes after the one before it is said by their order.
"""

from __future__ import annotations

from robosandbox.agent.language.template import Constructions

# fmt: off
PARTS = {
    "when": "(when!|once!|after!|as soon! as)",
    "they": "(it|they|both|everything|(both|all|each|the two!|all three!) of them|they (all|both)|all three!|those|these|{_drawer})",
    "are": "(is|are|has|have|has been|have been|have both|have all) [all|both|safely|been|now|finally|each]",
    "there": "(in|inside|in there|in it|up|up there|on there|on it|there|in place|changed places|changed over|swapped [places|over|round]|traded places|exchanged|moved|done|finished|away|put away|stacked [up]|tapped|sorted|gone|out of the way|together|side by side|shut|closed|open|poured|empty)",
    "moved": "(moved|touched|lifted|picked up|put anywhere|put away|put in|gone anywhere|taken|pushed|swapped)",
    "joint": "(,|.|;|and|, and|and then|, and then|but|, but)",
    "wants": "(want|need|would like|am after!|are after!|mean|was thinking of)",
    "be_at": "((has to|must|should|needs to|is to|ought to|can|is supposed to|is meant to) (stay|remain|be|go|end up|come|stand|sit|finish up|finish)|stays|remains|ends up|comes|stands|sits|finishes up|finishes)",
    "some": "(somewhere|someplace|some place|anywhere) [[where] (it is|they are)] [safe|safer|secure|sensible|nice|clean|good|else!]",
    "kept": "[where|so|that|so that] (it|they) (can|could|will|would|does|do|may|might|is|are) not! [be|get|going to] (roll|rolling|fall|tip|slide|slip|drop|escape|lost|break|broken|damaged|dirty|in the way|knocked) [off|away|over|down|out|around|about] [of|from|onto|on] [the (table|desk|edge|floor|counter|bench)]",
    "serves": "(is|would be|will be|looks|seems|sounds) (fine|ok|okay|good|perfect|best|great|ideal|safe|safest)|(will|would|should) do|works",
    "near_me": "(closer|closest|nearer|nearest|next!) to (me|us) (,|.|;)",
    "except": "(except [for]|but [for]|apart from|aside from|other than|excluding|excepting|with the exception of|barring|bar|save for)",
    "room": "(table|desk|tabletop|counter|bench|worktop|workbench|surface)",
    "lone": "(that|it|this) is (the one|what|the {_NOUN})",
}
WHEN = {
    # Which step comes last, told before the others.
    "<start> (the|your) [very] last! (thing|step) [[that] you do|[for you] to do] (is|should be|must be|has to be|will be|would be) [to] {VERB} {thing} [{place}] (,|;|.|:) [but|and] [then] [first! [of all|off]|(start|begin) (with|by)] {VERB2} {text} <end>": "finish by {VERB} {thing} {place} , {VERB2} {text}",
    "<start> finish by {text} (,|;|, and|and) in between [,] [you] [should|can|must] {VERB}": "finish by {text} , then {VERB}",
    "<start> [first!] [of all] {VERB} {thing} [{place}] <joint> (then|finally|lastly|last!|last! of all|at the end|in the end) [,] {VERB2} {thing2} [{place2}] <joint> in between [,] [you] [should|can|must] {VERB3} {thing3} [{place3}] <end>": "{VERB} {thing} {place} , then {VERB3} {thing3} {place3} , then {VERB2} {thing2} {place2}",
    # What comes after the step before it, once that is done.
    "<joint> <when> <they> <are> <there> [,] [then] {VERB}": ", then {VERB}",
    "<joint> {VERB=home} <when> <they> <are> <there> <end>": ", then {VERB=home}",
    "<joint> {VERB=tap} {thing} <when> <they> <are> <there> <end>": ", then {VERB=tap} {thing}",
    "<joint> {VERB=close} {thing} <when> <they> <are> <there> <end>": ", then {VERB=close} {thing}",
    "<joint> <when> <they> <are> <there> [,] [then] [you (can|may|should|could|will|must)] [then|now] [(finish|end) [off|up] (by|with)] {VERB}": ", then {VERB}",
    # Put off, and done in its turn.
    **{
        f"<start> do not! {{_VERB={verb}}} {{thing}} [just] yet! (,|.|;|:) [but] first! {{text}} (,|.|;|, and|and) [only!] then {{VERB={verb}}} (it|them) <end>": f"{{text}} , then {{VERB={verb}}} {{thing}}"
        for verb in ("open", "close", "tap", "push", "pick", "put")
    },
    "<start> do not! {_VERB=put} {thing} {_place} [just] yet! (,|.|;|:) [but] first! {text} (,|.|;|, and|and) [only!] then {VERB=put} (it|them) {in:in|into|inside|on|onto|beside} {one} <end>": "{text} , then {VERB=put} {thing} {in} {one}",
    "<joint> [only!] then (should|may|can|must|do|will|shall) you {VERB}": ", then {VERB}",
    "<joint> after! (those|these|them|both|that) [two!|three!|of them] [,] {VERB}": ", then {VERB}",
    "(after|once!|as soon! as) {thing} (has|have|is|are) [been] {VERB} {place}": "after you {VERB} {thing} {place}",
    "(after|once!|as soon! as) {thing} (has|have) been {VERB=tap} <edge>": "after you {VERB=tap} {thing}",
    "before {thing} (is|are|gets|get) [put|being] {VERB} {place}": "before you {VERB} {thing} {place}",
    "before {drawer} (is|gets) [being] (closed|shut) <edge>": "before you close {drawer}",
    "before {thing} (is|are|gets|get) {VERB=tap} <edge>": "before you {VERB=tap} {thing}",
    "(,|.|;) [but|and] {words} before! (any|either|all|one|anything|both|they|it) [of (them|those|these)] (is|are|has been|gets|get) <moved> <end>": ", but first {words}",
    "[,] but [only!] after you have {VERB} {thing} [{place}] <end>": "after you have {VERB} {thing} {place}",
    "[,] but not! before! you have {VERB} {thing} [{place}] <end>": "after you have {VERB} {thing} {place}",
    "<start> do not! {words} until! you have {VERB} {thing} [{place}] <end>": "{words} after you have {VERB} {thing} {place}",
    ", having first! {VERB} {thing} [{place}] <end>": "after you have {VERB} {thing} {place}",
    "(,|.|;|and|but) [and|but] do {thing} {turn:first|last} [of all] <end>": ", {thing} {turn}",
    "<joint> after! (it|them|those|these|that) {thing} <edge>": "and then {thing}",
    "{thing} (and|, and|,) last! of all {thing2} {place}": "{thing} and {thing2} {place}",
}
WITH = {
    "(exactly|precisely|just) {same:the same|the same thing} (with|to|for)": "{same} with",
    "<verb> (pick up|take|grab|lift|get) {one} and hold (it|on to it) (,|and|then|, then|, and|, and then) [then] {_VERB=put} (it|that) {place}": "put {one} {place}",
    "{place} and (let go [of (it|them)]|(release|drop) (it|them)) (in there|inside|in it|there) <edge>": "{place}",
    "<verb> (get|move|take|clear|put) {thing} out of (the|my|our) way by {doing} (it|them|that) {place}": "start {doing} {thing} {place}",
    "<verb> {VERB=put} {thing} {in:in|into|inside|on|onto} {one} (and|, and|,|;) {thing2} (with|along with|together with) (it|them|that) <edge>": "{VERB=put} {thing} and {thing2} {in} {one}",
    "{in:in|into|inside|on|onto} {one} (and|, and|,|;) {thing} (with|along with|together with) (it|them|that) <end>": "{in} {one} , then put {thing} {in} {one}",
    "{in:in|into|inside|on|onto} {one} (and|, and|,|;) (with|along with|together with) (it|them|that) [goes|go] {thing} <end>": "{in} {one} , then put {thing} {in} {one}",
    ", {_one} and all (,|<end>)": "",
    "<verb> give {thing} {_A} [{_LIGHT_ADJECTIVE}] {LIGHT_NOUN} each": "{LIGHT_NOUN} {thing}",
}
STAYS = {
    "(,|.|;|, and|and|, but|but) {drawer} (stays|remains|is to stay|should stay|must stay|has to stay|needs to stay|can stay|is to remain|should remain|must remain) {state:closed|shut} <edge>": ". leave {drawer} {state}",
    "{many} (goes|go|belongs|belong|should go|can go) {place} (,|;|, but|but) [just|only!|namelyonly] {thing} (does|do|should|can|may) not! [go (there|in|in there)] <edge>": "{many} except {thing} goes {place}",
    "{many} [away|up|over] {place} , all of (it|them) (but|except|except for|apart from|bar|save|other than) {thing} <edge>": "{many} except {thing} {place}",
    "{many} , all of (it|them) (but|except|except for|apart from|bar|save|other than) {thing} <end>": "{many} except {thing}",
    "{many} , all (but|except|except for|apart from|bar|save|other than) {thing} <end>": "{many} except {thing}",
    "{many} [away|up|over] {place} , all (but|except|except for|apart from|bar|save|other than) {thing} <edge>": "{many} except {thing} {place}",
    "[,|.|;|and|but] [and|but] leave the other (two!|three!|four!|five!) [{_NOUN}] (alone|there|be|where (they|it) (are|is)|as they are|untouched) <edge>": ". leave everything else alone",
    "(,|.|;|and|but) [and|but] the other (two!|three!|four!|five!) [{_NOUN}] [can|should|must|to] (stay|remain|are to stay) (put|there|where they are|as they are|alone|on the table) <edge>": ". leave everything else alone",
    "(,|.|;|and|but) [and|but] nothing! else (moves|is to move|should move|must move|may move|gets moved|is [to be] moved|should be (moved|touched)|is [to be] touched|changes) <edge>": ". leave everything else alone",
}
LEFT = {
    # What is neither of those that were told of: "the other" tells how many there can be.
    "the (one|{_NOUN}) [(that|which) (is|was)] [still!] (left over|left behind)": "the other one",
    "the (one|{_NOUN}) (that|which) (is|was) [still!] left <edge>": "the other one",
    "the (leftover|left over) (one|{_NOUN})": "the other one",
    "the remaining one": "the other one",
    "{two:two} of [the|those|these|all] [three!] {many} {text} the third! one <edge>": "{two} of the {many} {text} the other one",
    "{three:three} of [the|those|these|all] [four!] {many} {text} the fourth! one <edge>": "{three} of the {many} {text} the other one",
    "the other one , (the one|that is) [that is|the one] [still!] (standing|sitting|lying|left) [outside|over] <edge>": "the other one",
}
TOLD = {
    # What is wanted of a place, and then the place.
    "<some> [<kept>] (,|.|;|:) [maybe|perhaps|say|like|in|into|i think|, in] {holder} (<serves>) [for (it|that|them)] <edge>": "in {holder}",
    "<some> [<kept>] [,|.|;|:] (maybe|perhaps|like|such as|for example|for instance|say|ideally|preferably) [,] [in|into] {holder} <edge>": "in {holder}",
    # Which one, told by the colour that the other has or lacks.
    "the {word} that is not {adjective} {words} the {word2} that is <edge>": "the {word} that is not {adjective} {words} the {adjective} {word2}",
    "the {word} that is {adjective} {words} the {word2} that is not <edge>": "the {word} that is {adjective} {words} the {word2} that is not {adjective}",
    "the {word} that is {adjective} {words} the {word2} that is [too|also] <edge>": "the {word} that is {adjective} {words} the {adjective} {word2}",
    "the {COLOUR} {word} {words} the {word2} that is not <edge>": "the {COLOUR} {word} {words} the {word2} that is not {COLOUR}",
    "(than|from) [where] (it|they) (is|are|stands|stand|sits|sit|was|were) [now|currently|right now|at the moment|at present] <edge>": "",
    "? [yes|so|then|okay] [please] (do (it|that|this|so)|make it so|make (that|it) happen|go ahead|go for it) [then|now|for me] <end>": "?",
    "<verb> (turn|flip|rebuild|reverse|invert) [the|this|that] [little|small|tall|big|short] (tower|stack|pile) [around|round|over|upside down|the other way (round|around|up)] [,] [and|so|such] [that] {one} (ends up|is|goes|comes|sits|stands) (on|on top of) {one2} [instead!|this time] <end>": "put what is on {one} on the table , then put {one} on {one2}",
    # Of two, the thing that the arm cannot tell is not the one.
    "the {word} [that is|which is] <near_me> [hmm|oh|wait] no! [,] [wait|sorry|actually|rather] [,] the {adjective} one": "the {adjective} {word}",
    "the {_word} [that is|which is] <near_me> [hmm|oh|wait] no! [,] [wait|sorry|actually|rather] [,] {that}": "{that}",
    "<edge> {thing} (should|must|needs to|need to|has to|have to|ought to|is to|are to) (be|sit|stand|lie) {distance} {further:further|farther} {way} <edge>": "push {thing} {distance} {further} {way}",
    "<edge> (i|we) <wants> {thing} [to (be|sit|stand|lie)] {distance} {further:further|farther} {way} <edge>": "push {thing} {distance} {further} {way}",
    # Several towers, each told by what stands on what.
    "<start> not! {one} (and|or!|nor!|,) [and|but] [also] [not!|nor!] {one2} (,|.|!|;|:) [but|so|just] {VERB} the other [one|{_NOUN}] <end>": "leave {one} and {one2} alone . {VERB} the other one",
    "<start> neither! {one} nor! {one2} (,|.|!|;|:) [but|so|just] {VERB} the other [one|{_NOUN}] <end>": "leave {one} and {one2} alone . {VERB} the other one",
    "<verb> [take|grab|get|fetch|have|here are|you see|there are] {one} and {one2} (:|;|.|,) [put] the (first!|former) [one] [goes|should go|belongs|is] {place} (,|and|, and|;|.) the (second!|latter|other) [one] [goes|should go|belongs|is] {place2} <end>": "put {one} {place} , then put {one2} {place2}",
    "<edge> {one} (comes|should come|must come|has to come|needs to come|goes) out of {one2} (and|,) [and] {place} (,|;) [and] {one3} (goes|comes|should go|must go|can go) in [there|it] [instead!] <end>": "take {one} out of {one2} and put it {place} , then put {one3} in {one2}",
    "<edge> {one} (comes|should come|must come|has to come|needs to come|goes) off {one2} (and|,) [and] {place} (,|;) [and] {one3} (goes|comes|should go|must go|can go) on [there|it|top] [instead!] <end>": "take {one} off {one2} and put it {place} , then put {one3} on {one2}",
    "<verb> {VERB=pick} {one} off {one2} (and|,|, and) [then] {put:put|place|set|stand} {one3} there [instead!] <edge>": "{VERB=pick} {one} off {one2} and {put} {one3} on {one2}",
    "<verb> {VERB=pick} {one} out of {one2} (and|,|, and) [then] {put:put|place|set|drop} {one3} there [instead!] <edge>": "{VERB=pick} {one} out of {one2} and {put} {one3} in {one2}",
    "<verb> {VERB=close} {drawer} (after!|once!|when!) (you have|you|having) (opened|opening|open) it and (put|placed|dropped|laid|slid|popped|putting|placing|dropping|laying) {thing} (in|inside|into) [it|there] <end>": "open {drawer} , put {thing} in {drawer} , then {VERB=close} {drawer}",
    "<start> (make|build|stack) [me|us|for me|for us] two! [small|little|separate|different] (towers|stacks|piles) (,|:|;|of two! (,|:|;)) [one|the first! [one]] [with|has|of] {one} (on|on top of) {one2} (,|and|, and|;) [and] (another|another one|one|the other|the other one|the second! [one]) [with|has|of] {one3} (on|on top of) {one4} <edge>": "put {one} on {one2} , then put {one3} on {one4}",
    "[,] (because|since|as|for) (it|that|this|they) (is|are|was|were|has|have) not! [quite|really|been|all|even] {_name} [yet!|enough|any more|anymore|at all] <edge>": "",
    # Levels of a tower.
    "{one} <be_at> (at|to) the [very] bottom": "{one} goes at the bottom",
    "{one} <be_at> (on|at|to) [the] [very] top <edge>": "{one} goes on top",
    "{VERB=stack} {many} on top of (each other|one another) (,|;|.|:) {one} goes {at:at the bottom|on top}": "{VERB=stack} {many} ; {one} goes {at}",
    "(right|all the way|down) at the [very] bottom": "at the bottom",
    "as the (topmost|uppermost|top) (thing|one|object|item|piece|part|layer|floor|storey|level|block|cube|brick)": "on top",
    "as the (bottommost|lowest|bottom) (thing|one|object|item|piece|part|layer|floor|storey|level|block|cube|brick)": "at the bottom",
    "{put:put|place|set|stand} {one} on {one2} as (the|its|a) (roof|rooftop|crown|spire|lid) <edge>": "{put} {one} on {one2}",
    "{tower:tower|stack|pile|build|put|place|set|bottom|base} {text} {joint:,|and|, and|then|, then|and then|, and then} {one} [comes|goes] (as|for) (the|its|a) (roof|rooftop|crown|spire|summit|peak) <edge>": "{tower} {text} {joint} {one} on top",
    # What the clauses after it tell in full.
    "(<verb>|<edge> let us|<edge> (i|we) (want|need|have|would like) to) (sort|organise|organize|arrange|sort out) (this|these|those|them|everything|things|the things|this lot|all this|all of (this|these)|(this|the|my|our|your|that) [whole] <room>) [by (colour|color|kind|shape|size|type)] [out|up] [for (me|us)] (:|.|;) {thing} [(goes|go|belongs|belong|should go)] {place}": "{thing} goes {place}",
    "(,|.|;|, and|and) {drawer} (has to|must|should|needs to|is to|ought to) [then] be (shut|closed) (at the [very] end|in the end|afterwards|after! that|at last!|when! [you are] done) <end>": ", then close {drawer}",
    # What must not be somewhere, told before what may.
    "<start> no! {bare} {place} (,|but|, but) {thing} <end>": "do not put {bare} {place} . put {thing} {place}",
    "<start> no! {bare} [(go|goes|belong|belongs|may go|should go|are to go|must go|are allowed)] {place} [today|now|this time|please] <edge>": "do not put {bare} {place}",
    "{mark:.|;|!|:} no! {bare} [(go|goes|belong|belongs|may go|should go|are to go|must go|are allowed)] {place} [today|now|this time|please] <edge>": "{mark} do not put {bare} {place}",
    # What is left out, told before what it is left out of.
    "<start> <except> {thing} , [please] {VERB=put} {many} {place} <edge>": "{VERB=put} {many} except {thing} {place}",
    "<start> <except> {thing} , [please] {VERB=put} (every|each) {thing2} {place} <edge>": "{VERB=put} every {thing2} except {thing} {place}",
    "<start> <except> {thing} , {many} [(go|goes|belong|belongs|should go|can go|must go)] {place} <edge>": "put {many} except {thing} {place}",
    "<start> <except> {thing} , {many} (should|must|have to|need to|can|has to) be (put|placed|set|laid) {place} <edge>": "put {many} except {thing} {place}",
    # An order that is told before what it is the order of.
    "<start> {UP_ORDER} (:|,) {thing} (.|;|,) [now|so|then|please] (stack|pile|stack up|pile up|build a tower of|make a tower of|build a tower with) {many} [up] <end>": "stack {many} : {thing} , {UP_ORDER}",
    "<start> {DOWN_ORDER} (:|,) {thing} (.|;|,) [now|so|then|please] (stack|pile|stack up|pile up|build a tower of|make a tower of|build a tower with) {many} [up] <end>": "stack {many} : {thing} , {DOWN_ORDER}",
    # "there are two fruits here: the apple goes in the bin, the other one ..."
    "(,|;) but [only!|just] after": "after",
    "(,|;) but not! before! you {VERB} {text} <end>": "after you {VERB} {text}",
    "<start> (first!|1st!|firstly) {thing} {place} (,|;|.) [and] (second!|2nd!|secondly) {thing2} {place2} <end>": "{thing} {place} , then {thing2} {place2}",
    "<start> there (are|stand|lie|sit) (two!|a pair of) {word} [here|there|over there|on the table|in front of (you|me|us)] (:|;|.|,) {VERB} {one} {text} the other [one] {place} <end>": "{VERB} {one} {text} the other {word} {place}",
    # One of two that are alike in looks, by what it is: "of the two red things, the can ..., the other one ..."
    "<start> (of|out of|from among) the (two!|pair of) {adjective} (things|objects|items|ones) , {VERB} the {word} {text} the other [one|thing] {place} <end>": "{VERB} the {adjective} {word} {text} the other {adjective} thing {place}",
    "<start> (of|out of|from among) the (two!|pair of) {adjective} (things|objects|items|ones) , {VERB} the {word} {place} <end>": "{VERB} the {adjective} {word} {place}",
    "<start> (of|out of|from among) the (two!|pair of) {adjective} (things|objects|items|ones) , {VERB} the {word} <end>": "{VERB} the {adjective} {word}",
    "<start> (of|out of|from among) the (two!|pair of) {adjective} (things|objects|items|ones) , {VERB} the {word} {text} {VERB2} the other [one|thing] <end>": "{VERB} the {adjective} {word} {text} {VERB2} the other {adjective} thing",
    "(,|.|;) no [,] [wait|hang on|hold on|oh|sorry] [,] {_one} [is] in the way (,|.|;|:|, so|so) {way} [{way2}] [will do|would do|is fine|instead!] <end>": ", no , {way} {way2}",
    "{way} (will|would|should) (do|suffice|be (enough|plenty|fine)) <edge>": "{way}",
    "<start> {holder} is [already|still!|now|currently] [quite|completely|all] (open|closed|shut|empty|clear|free) [now|already] (,|.|;) [so|and] {VERB} {thing} {in:in|into} (it|there) <edge>": "{VERB} {thing} {in} {holder}",
    "<start> (before! (you do anything|anything) (else!|with {_thing}|to {_thing}) [happens|moves]|first! things first!) ,": "",
    "{one} [goes|go|should go|belongs] {place} (and|, and|,) {one2} [goes|go|should go|belongs] {place2} [,] (or! rather|rather|or! (no!|wait)|no! [,] [wait|actually] [,]|actually|sorry|or!) [,] [make it|make that] (vice versa|the other way (round|around|about)) <end>": "{one} {place2} , {one2} {place}",
    ", [and] not! (vice versa|the other way (round|around|about)) <edge>": "",
    "(,|, and|and|then) [then] {VERB} {thing} in last! [of all] <end>": ", then {VERB} {thing} in there",
    "<start> there (is|are) nothing! [left|else!] in {holder} [now|yet!|at the moment|any more|anymore] (,|.|;) [so|and] {VERB} {thing} {in:in|into} (it|there) <edge>": "{VERB} {thing} {in} {holder}",
    "[,] (now|now that|that) there is nothing! [left|else!] in (it|them|there|{_one}) [,]": "",
    ", that (it|they) (is|are) [completely|all|quite|nice and] (empty|emptied|clean|free) (,|<end>)": "",
    "[,] now that (it|they) (is|are) [completely|all|quite|nice and] (empty|emptied|clean|free) [,]": "",
    "instead of {thing} , which <is_so> ,": "instead of {thing} ,",
    "{that} , which <is_so> (,|<end>)": "{that}",
    "{except:except|except for|bar|but|apart from|but not|save|other than} {thing} , which [can|should|must|may|will|could] (go|goes|belong|belongs|be put|have to go|has to go|are to go|is to go) {place}": "{except} {thing} . put {thing} {place}",
    "<start> not! {one} [,|.|;] [but] the {word} [right|immediately|directly] to the {side:left|right} of it ,": "the {word} to the {side} of {one} ,",
    "{that} [that|which] (it|they) (was|were) in {back:back|away|down}": "{that} {back}",
    "<start> {one} (is|are) (the one|what) [that] (i|we) <wants> {place}": "{one} goes {place}",
    "<start> (the (thing|one|object) [that]|what) (i|we) <wants> {place} is {one} <end>": "{one} goes {place}",
    "<start> (move|take|get) {one} : it (goes|belongs) {place} <end>": "put {one} {place}",
    "<edge> {one} , <lone> [that] (i|we) <wants> {place}": "{one} goes {place}",
    "<verb> (tip|shake|empty) {_thing} out of {one} {into:into|onto|in|on} {one2}": "pour {one} {into} {one2}",
}
# fmt: on
PARTS["is_so"] = (
    "((i|we|he|she|they) (am|are|is) [still!|currently|busy] {_word} [with|on|at]"
    "|(is|are|was|were|looks|seems|feels|has been|have been) [still!|already|rather|quite|very|a bit|a little|far too|too|all] {_name})"
)
COMPOUND = Constructions(WHEN, WITH, STAYS, LEFT, TOLD, parts=PARTS)
