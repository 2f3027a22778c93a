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
    "(he|she) {goes:goes|go|must|should|has|needs|can|comes|belongs|will|wants}": "it {goes}",
    "{NOUN} (who|what) {is:is|are|stands|lies|sits|stay}": "{NOUN} that {is}",
    "{one} who {is:is|stands|lies|sits}": "{one} that {is}",
    "(all|everything) (what|which|that) is [a|an] {NOUN}": "every {NOUN}",
    "(all|everything) (what|which|that) are {NOUN}": "all {NOUN}",
    "{NOUN} {size:small|little|big|large|tiny} {go:go|goes|must|should|has|have|in|on|into|onto|to|is|are|,|and|next|near|beside|.|;}": "{size} {NOUN} {go}",
    "{NOUN} {size:small|little|big|large|tiny} <end>": "{size} {NOUN}",
    "the {word} (with|in|of|has) [the|a] {COLOUR} (colour|color)": "the {COLOUR} {word}",
    "the {word} (with|in|of) [the] (colour|color) {COLOUR}": "the {COLOUR} {word}",
    "{NOUN} (of|from|in|made of|made from) {stuff:metal|wood|plastic|glass|rubber|paper|cardboard|ceramic|porcelain}": "{stuff} {NOUN}",
    "the {many} , {both:both|all} [of them|together] , {go:go|goes|must|should|in|into|on|onto|to|have to|need to|come|belong}": "{both} the {many} {go}",
    "(beside|next) (of|from) {one}": "next to {one}",
    "(at|on|to|by) [the|its] {side:left|right} hand [side] (of|from) {one}": "to the {side} of {one}",
    "in the middle of (3!|three!) {NOUN}": "in the middle of the {NOUN}",
    "in (the|a) middle between": "between",
    # More, less, and how far.
    "more (far|distant|away) [away] from": "farther from",
    "more (far|distant) <edge>": "farther away",
    "<edge> {thing} (farther|further|more far) [away] from you [,|by|for] {distance}": "push {thing} {distance} away from you",
    "<edge> {thing} (nearer|closer|more near) [to|from] you [,|by|for] {distance}": "push {thing} {distance} towards you",
    "{distance} more {side:left|right} (from|of|than) where [it] (is|stands) [now]": "{distance} to the {side}",
    "where (was|stood|were) [standing] before": "where it was before",
    # Verbs that are another language's.
    "<verb> make [a|one] {VERB} (to|on|of|at) {thing}": "{VERB} {thing}",
    "(make|let) (fall|drop) {thing} {place}": "drop {thing} {place}",
    "from {one} (you [must|should|can] (pour|empty)|make empty|pour|empty) (in|into|to|inside) {one2} (, after! [you|that you]|, then|and after! [you]|and then|, and then) {VERB}": "pour {one} into {one2} , then {VERB}",
    "from {one} (you [must|should|can] (pour|empty)|make empty|pour|empty) (in|into|to|inside) {one2}": "pour {one} into {one2}",
    "then {thing} leave {place} <end>": "then put {thing} {place}",
    "<edge> [it] (would|could|is|will|would it|is it) [it] [be] possible [to have|that|to get|for|if!] {thing} [be|is|are|goes|go|to be|to go|would be|could be] {place} <edge>": "put {thing} {place}",
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
    "<edge> (take|pick|get|grab) first! {one} , [and] then {one2} , (the two!|both|they|the both|them|two!|all) [of them] [both|two!] (go|goes|belong|come|must go|have to go|should go) {place}": "put {one} {place} , then put {one2} {place}",
    "<edge> [make|build|do] [me] [a|one] (tower|stack|pile) [:|,|with|.|like this] (down|below|under|at bottom|at the bottom|on the bottom|bottom) [is|goes|comes|put|stands|:] {one} (,|;|and|, and|then|, then) (on|upon|over) (it|that|top|top of it|this) [is|goes|comes|put|stands] {one2} (,|;|and|, and|then|, then) (on|upon|over) (it|that|top|top of it|this) [is|goes|comes|put|stands] {one3} <end>": "put {one2} on {one} , then put {one3} on {one2}",
    "<edge> [make|build|do] [me] [a|one] (tower|stack|pile) [:|,|with|.|like this] (down|below|under|at bottom|at the bottom|on the bottom|bottom) [is|goes|comes|put|stands|:] {one} (,|;|and|, and|then|, then) (on|upon|over) (it|that|top|top of it|this) [is|goes|comes|put|stands] {one2} <end>": "put {one2} on {one}",
}
"""What is the same in plain words, whoever says it."""
