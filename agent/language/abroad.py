"""Orders as those say them who have the language from another one, each with the plainer words for it (see `template`)."""

from __future__ import annotations

# fmt: off
_MUST = "(must|should|has to|have to|needs to|need to|shall)"
ASIDES_ABROAD = {
    "<edge> (how|what) [do|does|would] (you|we|they|one|i) (call|say|name) (it|that|this) [again!|in english|the word] <edge>": "",
    "<edge> (how (is|was) (it|that|this) (called|named|said)|how (it|that|this) is (called|named|said)|how to say|how you say|how do you say|how i say|how should i say|how is the (name|word)|what is the (name|word)) [it|that|again!|in english] <edge>": "",
    "[please|and] [kindly] do the needful [and] {VERB}": "{VERB}",
}
ABROAD = {
    # Words that have another's place or form.
    "(he|she) {goes:goes|go|must go|should go|has to go|comes|belongs|must be|should be}": "it {goes}",
    "{NOUN} (who|what) {is:is|are|stands|lies|sits|stay}": "{NOUN} that {is}",
    "{one} who {is:is|stands|lies|sits}": "{one} that {is}",
    "(all|everything) (what|which|that) is [a|an] {NOUN}": "every {NOUN}",
    "(all|everything) (what|which|that) are {NOUN}": "all {NOUN}",
    "{NOUN} {size:small|little|big|large|tiny} {go:go|goes|must|should|has|have|in|on|into|onto|to|is|are|,|and|next|near|beside|.|;}": "{size} {NOUN} {go}",
    "{NOUN} {size:small|little|big|large|tiny} <end>": "{size} {NOUN}",
    "the {word} (with|in|of|has) [the|a] {COLOUR} (colour|color)": "the {COLOUR} {word}",
    "the {word} (with|in|of) [the] (colour|color) {COLOUR}": "the {COLOUR} {word}",
    "{NOUN} (of|made of|made from|made out of) {stuff:metal|wood|plastic|glass|rubber|paper|cardboard|ceramic|porcelain}": "{stuff} {NOUN}",
    "the {many} , {both:both|all} [of them|together] , {go:go|goes|must|should|in|into|on|onto|to|have to|need to|come|belong}": "{both} the {many} {go}",
    "(beside|next) (of|from) {one}": "next to {one}",
    "(at|on|to|by) [the|its] {side:left|right} hand [side] (of|from) {one}": "to the {side} of {one}",
    "in (the|a) middle between": "between",
    "that {one} (it|they|he|she) {goes:goes|go|must|should|has|is|comes|belongs}": "that {one} {goes}",
    "on [the] inside of": "in",
    "(putted|putten)": "put",
    "in [the] {side:left|right} <edge>": "to the {side}",
    # More, less, and how far.
    "more (far|distant|away) [away] from": "farther from",
    "more (far|distant) <edge>": "farther away",
    "<edge> {thing} (farther|further|more far) [away] from you [,|by|for] {distance}": "push {thing} {distance} away from you",
    "<edge> {thing} (nearer|closer|more near) [to|from] you [,|by|for] {distance}": "push {thing} {distance} towards you",
    "{distance} more {side:left|right} (from|of|than) where [it] (is|stands) [now]": "{distance} to the {side}",
    "where (was|stood|were) [standing] before": "where it was before",
    # Verbs that are another language's.
    "<start> [it] is (necessary|needed|need|important|required) [to|that you] {VERB}": "{VERB}",
    "<start> it is need (to|that you) {VERB}": "{VERB}",
    "<edge> i (will|would) that you [to] {VERB}": "{VERB}",
    "<edge> {thing} (need|needs|ought|have|has) be {place}": "{thing} needs to be {place}",
    "<verb> {_VERB=push} [a] (little|small|tiny) bit {thing} {way}": "push {thing} {way} a little bit",
    "<edge> {thing} {way} (move|push|shift) [by|for] {distance} <edge>": "push {thing} {way} {distance}",
    "<edge> {thing} {place} you (must|should|have to|can|will|need to|shall) (put|place|set|lay) <edge>": "put {thing} {place}",
    "<verb> (make|do) {open:open|close|shut} {drawer}": "{open} {drawer}",
    "<edge> {drawer} (make|do) {open:open|close|shut} <edge>": "{open} {drawer}",
    "<verb> (change|exchange) {one} (with|and) {one2} <edge>": "swap {one} and {one2}",
    "<verb> make [a|one] {VERB} (to|on|of|at) {thing}": "{VERB} {thing}",
    "(make|let) (fall|drop) {thing} {place}": "drop {thing} {place}",
    "from {one} (you [must|should|can] (pour|empty)|make empty|pour|empty) (in|into|to|inside) {one2} (, after! [you|that you]|, then|and after! [you]|and then|, and then) {VERB}": "pour {one} into {one2} , then {VERB}",
    "from {one} (you [must|should|can] (pour|empty)|make empty|pour|empty) (in|into|to|inside) {one2}": "pour {one} into {one2}",
    "then {thing} leave {place} <end>": "then put {thing} {place}",
    "<edge> [it] (would|could|would it|could it|is it|will it) [be] possible [to have|to get|for] {thing} [be|go|to be|to go] {place} <edge>": "put {thing} {place}",
    "<start> [it] (would|could|would it|could it|is it) [be] possible (that|if!) {thing} (goes|go|comes|would be|could be|would go|could go) {place} <end>": "put {thing} {place}",
    "<start> is possible [to have|to get|that] {thing} [goes|go|comes] {place} ?": "put {thing} {place}",
    "<edge> {thing} , [please] [you] (take|pick|grab|get|remove) [it|them] [away|up|off] [from [the] table] and (give|put|place|throw|drop|let|lay|bring) [it|them] {place} <edge>": "put {thing} {place}",
    "<verb> (take|pick|grab|get|catch) [up] {thing} [away|up] [from [the] table] and (give|let|leave|lay) (it|them) {place} <edge>": "put {thing} {place}",
    "<verb> (catch|take|pick) {one} and (let|leave) (in|on|into) {one2} <edge>": "put {one} to {one2}",
    f"<edge> {{thing}} , {{place}} (it|they|he|she) {_MUST} [go|be|come|stand|lie] <edge>": "put {thing} {place}",
    f"<edge> {{place}} (it|they|he|she) {_MUST} [go|be|come|stand|lie] <edge>": "put it {place}",
    f"<edge> {{place}} {_MUST} (come|go|be) {{thing}} <edge>": "put {thing} {place}",
    f"{{drawer}} (,|and|then|and then|, and|, then|, and then) inside ({_MUST} (come|go|be)|goes|go|comes|come|you [must|should] put|you place|put|place) {{thing}}": "{drawer} , put {thing} in it",
    f"<edge> inside (of|from|) {{container}} ({_MUST} (come|go|be)|goes|go|comes|come|you put|you place|put|place) {{thing}} <edge>": "put {thing} in {container}",
    "<edge> for {thing} there is [a|the] [place|room|space|spot] {place} <end>": "put {thing} {place}",
    "(and|then|, and|.|,) after! (finish|finishing|finished|the finish|that finish|all finish|ready|work) [you|it|this|that] {VERB}": ", then {VERB}",
    "(and|then|, and|.|,) after! (you|we|it|that) (finish|finished|finishes|are finished|is finished|have finish) [it|this|that] {VERB}": ", then {VERB}",
    "<edge> (take|pick|get|grab) first! {one} , [and] then {one2} , (the two!|both|they|the both|them|two!|all) [of them] [both|two!] (go|goes|belong|come|must go|have to go|should go) {place}": "put {one} {place} , then put {one2} {place}",
    "<edge> [make|build|do] [me] [a|one] (tower|stack|pile) [:|,|with|.|like this] (down|below|under|at bottom|at the bottom|on the bottom|bottom) [is|goes|comes|put|stands|:] {one} (,|;|and|, and|then|, then) (on|upon|over) (it|that|top|top of it|this) [is|goes|comes|put|stands] {one2} (,|;|and|, and|then|, then) (on|upon|over) (it|that|top|top of it|this) [is|goes|comes|put|stands] {one3} <end>": "put {one2} on {one} , then put {one3} on {one2}",
    "<edge> [make|build|do] [me] [a|one] (tower|stack|pile) [:|,|with|.|like this] (down|below|under|at bottom|at the bottom|on the bottom|bottom) [is|goes|comes|put|stands|:] {one} (,|;|and|, and|then|, then) (on|upon|over) (it|that|top|top of it|this) [is|goes|comes|put|stands] {one2} <end>": "put {one2} on {one}",
}
"""What is the same in plain words, whoever says it."""
