"""Other ways to say the same: nominalized orders, asides, shorthand; each in the words that the grammar knows.

A rule replaces words by words that mean the same, or leaves out what only repeats; it never leaves out a condition, a
prohibition or a number. The rules run on sentences that the grammar did not understand as they stand.
"""

from __future__ import annotations

import itertools
import re
from collections.abc import Callable, Sequence

from robosandbox.agent.language.courtesies import MARKS
from robosandbox.agent.language.idioms import plainly
from robosandbox.agent.language.tokens import Token

_LIFT = r"lift|grab|pick up|pickup|pick|hoist|raise|hold"
_PUSH = r"push|shove|nudge|slide|bump|knock|prod|pull|tug"
_TAP = r"tap|touch|pat|press|poke|dab|boop|rap|bop"
_OTHER = r"stack|swap|pour|toss|sort|tidy|move|drop"
_ADJECTIVE = r"(?:(?:gentle|little|small|quick|light|tiny|slight|good|nice|soft|careful|firm|hard|big|short|bit of a|wee|friendly|proper|single) )*"
_WORD = r"[^\s,.;:!?]+"
_NP = rf"(?:(?!and |then |but |so |if |when ){_WORD} ){{0,5}}?(?!and |then |but ){_WORD}"
_END = r"(?= [,.;!?] | $)"
_ENOUGH = (
    r"(?:will|would|should|ought to|must|can|could|is|are|would be|will be|should be|ought to be|seems|shall)(?: be)?"
    r"(?: (?:do|enough|plenty|suffice|sufficient|fine|good|okay|ok|alright|right|perfect|about right|all i need|all i want|all it needs))"
    r"(?: (?:it|nicely|the trick|the job|for me|for now))?|suffices|is the right distance"
)
_UNIT = r"(?:cm|cms|centimetres|centimeters|centimetre|centimeter|mm|millimetres|millimeters|inches|inch|metres|meters)"
_LISTED = rf"((?:the |both |all |two |three |four )?{_NP}(?: , {_NP})*(?: and {_NP})?)"
_NAMELY = (
    r"(?:meaning|that is|that are|that is to say|those are|these are|which is|which are|which means|that means|that would be|"
    r"those would be|i mean|i am talking about|namely|specifically|in other words|to be (?:exact|precise|specific|clear)|as in|viz|aka|in particular)"
)
_SURELY = r"(?:will|would|might|may|you will|you would)"
_ROOM_WORDS = r"(?:table|desk|tabletop|counter|bench|worktop|workbench|surface)"

Replacement = str | Callable[["re.Match[str]"], str]


_OTHERS = r"(?:the rest|everything else|all else|the others|all the others|all others|the remaining (?:things|ones|objects|items))(?: all)?(?: goes| go| should go| can go| belongs| is to go| must go)?(?= in| on| to| next| away| beside)"
_INTO = r"(?:into|in|inside|to|onto|on)"
_PEOPLE = (
    r"(?:daughter|son|wife|husband|mum|mom|mother|dad|father|boss|friend|kid|kids|child|children|baby|teacher|customer|guest|chef|"
    r"doctor|professor|colleague|partner|girlfriend|boyfriend|brother|sister|neighbour|neighbor|client|manager|supervisor|nurse|"
    r"cook|cat|dog|grandma|grandpa|roommate|flatmate|team|family|student|patient|waiter|barista|bartender|lab|lady|man|woman)"
)


def _by_size(match: re.Match[str]) -> str:
    """As in "the stones into the bucket, smallest first"; a tower has an order of its own."""
    if any(word in match.string for word in (" stack ", " pile ", " tower ", " build ", " line ")):
        return match[0]
    rising = match[3] in ("smallest", "littlest", "tiniest", "small", "little")
    return f" {match[1]} in {'rising' if rising else 'falling'} size {match[2] or ''}".rstrip()


def _other_way_round(match: re.Match[str]) -> str:
    """As in "put the vial where the sponge is and the sponge where the vial was"."""
    first, second, again, back = (match[k].split()[-1] for k in (1, 2, 3, 4))
    return f" swap {match[1]} and {match[2]}" if (first, second) == (back, again) else match[0]


_FORBIDS = re.compile(r" (?:not|never|no|without|avoid|nor|neither|unless|if) ")


def _single(noun: str) -> str:
    """Return the singular of a plural: "dice", "cubes"."""
    if noun == "dice":
        return "die"
    plural = noun.endswith("s") and not noun.endswith("ss")
    return noun[:-2] if plural and noun.endswith(("xes", "shes", "ches", "sses")) else noun[:-1] if plural else noun


def _bottom_up(match: re.Match[str]) -> str:
    """As in "a stack with the wood: large, medium, small from the bottom up"."""
    noun = _single(match[1])
    order = [part.split()[-1] for part in re.split(r" (?:, and|,|and) ", match[2])]
    if len(set(order)) != len(order) or _FORBIDS.search(match.string):
        return match[0]
    order = order if match[3] == "bottom" else order[::-1]
    return ", then".join(
        f" put the {upper} {noun} on the {lower} {noun} " for lower, upper in itertools.pairwise(order)
    ).rstrip()


def _come_back(match: re.Match[str]) -> str:
    """As in "put the large one in the box and come back for the small one": what for is not said, so it is picked."""
    return match[0] if _FORBIDS.search(match.string) else f" , then pick up {match[1]}"


def _white_on_red(match: re.Match[str]) -> str:
    """As in "stack the dice, white on red": both are dice."""
    noun = _single(match[1])
    return f" stack the {match[2]} {noun} on the {match[3]} {noun}"


def _only_repeats(match: re.Match[str]) -> str:
    """As in "the pawns in the box, leave everything else"; not where everything was to be moved."""
    moved_all = re.search(r" (?:everything|all|anything|rest|others) ", f" {match.string[: match.start()]} ")
    return match[0] if moved_all else ""


def _after_a_step(match: re.Match[str]) -> str:
    """As in "put the can in the bin, then tap the cup once it is there"; alone it is a condition, which is kept."""
    return "" if re.search(r" (?:and|then) ", match.string[: match.start() + 1]) else match[0]


_KIND_OF = (
    r"(?:red|blue|green|yellow|orange|purple|pink|brown|black|white|grey|gray|small|medium|large|big|little|tall|short)"
)
_WHERE = r"(?:to )?where"
_IS = r"(?:is|stands|sits|was|stood|sat)(?: now| right now| before)?"
_SPELLED: tuple[tuple[re.Pattern[str], Replacement], ...] = tuple(
    (re.compile(pattern), replacement)
    for pattern, replacement in (
        (rf" (?:stack|pile)(?: up)? (?:the |both |both the |those |these )(\w+s|dice)(?: up)? [,:] (?:the )?({_KIND_OF})(?: one)? on(?: top of)? (?:the )?({_KIND_OF})(?: one)?(?= (?:[.!] )?$)", _white_on_red),
        (rf" (?:put|place|set|move|bring) the (\w+) (\w+) {_WHERE} the (\w+) (?:one|\2) {_IS}(?: ,)? and (?:put )?the \3 (?:one|\2) {_WHERE} the \1 (?:one|\2) {_IS}(?= (?:[.!] )?$)", r" swap the \1 \2 and the \3 \2"),
        (r"^ (put |place |drop |toss |move |stick |pop |)(?:the |those |my )?((?:(?!the |a |and |not )\w+ ){0,2}?(?:\w+s|dice)) (in|into|inside|on|onto) ((?:the |that |my )?(?:(?!the |and |not |but )\w+ ){0,2}?\w+(?<!s)) , both(?: of them| of those)?(?= (?:[.!] )?$)", r" \1both \2 \3 \4"),
    )
)  # fmt: skip
_RULES: tuple[tuple[re.Pattern[str], Replacement], ...] = tuple(
    (re.compile(pattern), replacement)
    for pattern, replacement in (
        # Shorthand.
        (r" (next|close|closer|over|near|adjacent|back|up|on|in) 2\.0 (?!cm |mm |cms |inch|centi|milli|m |cubes|balls|of )", r" \1 to "),
        (r" 4\.0 (?:me|us)(?= )", " "),
        (r" (?!(?:in|on|with|to|pick|up|grab|put|take|get|and|or|as|into|onto|for|of|from|by|is|such|push|tap) )(\w+) an (?=[bcdfgjklmnpqrstvwxyz])", r" \1 and "),
        (r" (?<!on )(?<!the )(?<!to )(?<!at )(?<!from )(?<!off )(?<!onto )(?<!very )(top|front) of (?=\w)", lambda m: f" {'on' if m[1] == 'top' else 'in'} {m[1]} of "),
        (r" no (touch|move|push|pick up|pick|take|put|grab|lift|open|close|bump|hit) (?=\w)", r" do not \1 "),
        (rf"^ neither ({_NP}) nor ({_NP}) [:,] (?:but )?", r" do not touch \1 and \2 . "),
        (r" along (?=to the |to your |towards |toward )", " "),
        (rf" (tap|touch|pat|poke|press|rap|bop|boop)( on)? ({_NP}) on (?:its |the )?(?:top|head|lid|upper side|top side|upper surface|cap|tip)(?= (?:[,.;!?]|and|then|once|twice) | $)", r" \1 \3"),
        (rf" (?=the |my |that |this |both )({_NP}(?: and {_NP})?) (?:needs|need|wants|want|requires|require|could do with|deserves|deserve|is in need of) (?:a )?(?:good |quick )?(\w{{3,}}ing)((?: up| down| over| away)?)(?= )", r" start \2\3 \1"),
        (rf"^ (?=the |that )({_NP}) : (open|close|tap|touch|push)(?= (?:[,.;!?] )?$)", r" \2 \1"),
        (r"(^|,|and|then) (?:up|off) with (?=the |that |this |my )", r"\1 pick up "),
        (r"(^|,|and|then) (?:away|down|in|off) with ((?:the |that |this |my )[\w ]+?)(?: ,)? (?=(?:into|in|onto|on|to) )", r"\1 put \2 "),
        (r" (home|place|spot) is (?=(?:the |that )(?:\w+ )?(?:bowl|bin|box|basket|tray|drawer|crate|bucket|dish|container) )", r" place is in "),
        (rf" (?:let |have |make |get )?(?=the |that |my )({_NP}) (?:and|with) ((?:the |that |my ){_NP}) (?:should|must|need to|have to|could|can|want to|would like to|to|ought to|are to)? ?(?:swap|trade|switch|exchange|change)(?: places| positions| spots| seats| locations)?(?: with each other)?(?= (?:[,.;!?] )?$)", r" swap \1 and \2"),
        (rf" (?:put|place|set|move|bring) ((?:the |that |my ){_NP}) (?:to )?where ((?:the |that |my ){_NP}) (?:is|stands|sits|was)(?: now| right now| at the moment| currently)?(?: ,)? (?:and )?(?:vice versa|the other way (?:round|around)(?: too)?|then (?:do )?the reverse|\2 where \1 (?:is|stands|sits|was)(?: now| right now| at the moment)?)(?= (?:[,.;!?] )?$)", r" swap \1 and \2"),
        (rf" (?:put|place|set|move|bring) ((?:the |that |my ){_NP}) (?:to )?where ((?:the |that |my ){_NP}) (?:is|stands|sits|was)(?: now)?(?: ,)? and (?:put )?((?:the |that |my ){_NP}) (?:to )?where ((?:the |that |my ){_NP}) (?:is|stands|sits|was)(?: now| before)?(?= (?:[,.;!?] )?$)", _other_way_round),
        (r" (?:i would like|i want|have|let|make|get|could|can) (?=the |those |these |both )((?:the |those |these |both )?(?:\w+ ){1,2}?)(?:to )?(?:swap|trade|switch|exchange|change) (?:places|positions|spots|seats|locations)(?: with each other)?(?= )", r" swap \1"),
        (rf"(^|,|and|then|that) ((?:the |that |my ){_NP}) (?:does|do|goes|follows)(?: the same| likewise| so| that)?(?= (?:[.;!?] )?$)", r"\1 \2"),
        (rf"(^|,|and|then|[.;]) (?:so (?:does|do|goes)|ditto(?: for| with)?|the same goes for|same goes for|likewise) ((?:the |that |my ){_NP})(?= (?:[.;!?] )?$)", r"\1 then \2"),
        (r" not (the \w+) (\w+) , (?:but )?(the \w+) one(?= )", r" \3 \2"),
        (r"^ not ((?:the |a )(?:\w+ ){0,2}?\w+) , (?:but )?(?=the |a )", r" "),
        (r" roll (the (?:\w+ ){0,2}?(?:ball|marble|sphere|orb)) (?!in |into |on |onto |out |off |away |over )(?!.* me )", r" push \1 "),
        (rf"^ (?:what|how) about ((?:the |a |all ){_NP}) ,", r" \1 ,"),
        (r" (?:afterwards|afterward|after that|at the end|in the end|once done|when done|once you are done|when you are done|to finish|to finish off)(?= (?:[.;!?] )?$)", _after_a_step),
        (rf" (?:rather )?than (?:in|on|into|onto|inside) {_NP}(?= (?:[.;!?] )?$)", ""),
        (r" (?:once|when|as soon as|after) (?:it|that|everything|all) (?:is|has been|was|gets) (?:there|in place|done|finished|in position|on it|in it|on there|in there|inside|moved|placed|put down|set down)(?= (?:[,.;!?] )?$)", _after_a_step),
        (rf" (?:use|take|with) ((?:the |a |that ){_NP}) (?:as|for|to be) (?:a|the|your|its) (?:base|foundation|bottom|support|stand|platform|pedestal|plinth)(?: ,)?(?: and| then)* (?:put|place|set|stack|stick|pop) ((?:the |a |that ){_NP}) (?:on|onto|on top of|atop) (?:it|that|top)(?= )", r" put \2 on \1"),
        (rf" it is ((?:the |a |that ){_NP}) (?:that )?(?:i|we) (?:want|need|would like|mean) (?=in |on |next |beside |to |inside |at )", r" i want \1 "),
        (r" so (?:that )?(?:it|they) (?:is|are|sits|stands|ends up|lands|comes to (?:rest|stand)) (?=next |beside |by |to |left |right |between |behind |in |on |near |close )", " "),
        (rf" ((?:the |all |all the |both |these |those )?(?:\w+ )??\w+s)(?: ({_INTO} (?:the |a |that )?{_NP}))?(?: one by one| one at a time)?(?: ,)? (?:in order (?:of size )?(?:, )?|in turn )?(?:starting |beginning |start |begin )?(?:with |from |going from )?(?:the )?(smallest|littlest|tiniest|biggest|largest|small|little|big|large)(?: one| ones| \w+)?(?: first| to (?:the )?(?:biggest|largest|smallest|big|large|small))?(?= (?:[.;!?] )?$)", _by_size),
        (rf" ((?:to the |on the )?(?:left|right) of|in front of|behind) ((?:the |a |that )?{_NP})(?: ,)? (?:about |around |roughly |some |approximately |at a distance of |with a gap of )?(\S+ {_UNIT}) (?:away|apart|from it|off|between them|distance)(?: from it)?(?= (?:[,.;!?] )?$)", r" \3 \1 \2"),
        (rf"(^|,|[.;]) ((?:the |that |my ){_NP}) (?:is|are) not where (?:it|they) (?:should be|belongs?|ought to be|goes?|go) ,", r"\1 \2 ,"),
        (rf"(^|,|[.;]) ((?:the |that |my ){_NP}) (?:does|do) not belong (?:there|here|on the {_ROOM_WORDS}|in the \w+|on the \w+) (?:,|[.;])(?: but)? (?:it|they) (?=belong|go|should|must|need)", r"\1 \2 "),
        (rf"^ (?:my|our|the|a|your) {_PEOPLE} (?:wants|want|needs|need|would like|would love|would prefer|prefers|likes|asked for|asks for|is asking for|demands) (?=the |a |all |both |every )", r" i want "),
        (r" (?:it|that) would (?:make me (?:so |very |really )?(?:happy|glad)|please me|be (?:so |very |really )?(?:nice|great|good|lovely|cool|wonderful|best|ideal|perfect)|make my day) (?:if|to see|to have|to get) (?=the |a |all |both |every )", " i want "),
        (r" (?:,|[.]) (?:shall we|will you|would you|could you|can you|should we|yeah|yes|eh|huh|right|okay|alright|deal|understood|got it|capisce)(?= (?:[,.;!?] )?$)", ""),
        (r" the (\w+est|\w+most) (two|three|four|five) (?=\w+s )", r" the \2 \1 "),
        (r" in with (?:it|them|that one|the others?)(?= (?:[,.;!?] )?$)", " in there"),
        (r" up in (a|one) (row|line)(?= )", r" in \1 \2"),
        (rf" a (?:hand|finger|palm|thumb)s? width ,(?: so| that is)? (?:about |around |roughly |some )?(\S+ {_UNIT})(?= )", r" \1"),
        (rf" (\S+ {_UNIT})( .*?) (?:by )?(?:the|that) same (?:amount|distance|again)(?= )", r" \1\2 \1"),
        (r" , (?:no , |wait , |oh , )*(?:actually )?(?:leave|forget|skip|drop|keep) (?:it|that)(?: there| alone)? (?:,|and|[.]) (?:instead )?(?=\w+ )", " , no , "),
        (rf" ((?:the |all the |these |those |both ){_NP}) (?:should|must|need to|have to|are to|could|can) (?:all )?(?:form|make|become|be (?:made |built |stacked )?into|be) a (?:\w+ )?(?:tower|stack|pile)(?= )", r" stack \1"),
        (rf" (?:push|shove|nudge|slide|scoot|brush|sweep|knock|shift) ((?:the |that |this |it|them)(?:{_NP})?) (aside|out of the way|to one side|to the side|off to one side)(?= (?:[,.;!?]|and|then) | $)", r" move \1 \2"),
        (rf"^ (?:as for|regarding|concerning|with regard to|when it comes to) ((?:the |a |all |this |that ){_NP}) [,:]", r" \1 ,"),
        (rf" (put|place|set|stand|pop|stick) ((?:the |a |that |this |it|them)(?:{_NP})?) (?:right |directly |close )?(?:up )?against (?=the |a |that |this )", r" \1 \2 next to "),
        (r" (?:,|and|but|;|[.])(?: (?:and|but|please|just))* (?:leave|keep) (?:everything|anything|all) else(?: alone| where it is| as it is| in place| untouched| there| be)?(?= (?:[.!] )?$)", _only_repeats),
        (r"^ (?:can|could|may|might) i (?:please )?(?:have|get) ((?:the|that|this) (?:(?!and |or |in |on |at |to |next |by |from |off |out |up |over |under |with |for |back |not |no |but )\w+ ){0,2}(?!up |back |over |off |out |in |on |away )\w+)(?: please| now)?(?= (?:[.!?] )?$)", r" pick up \1"),
        (rf"^ (?:i|we) (?:am|are|have)(?: all| just| now)* (?:finished|done)(?: with)? {_LISTED} [,.;:!] (?:so |please |you (?:can|may) )*(?=\w+ (?:it|them|both|these|those) )", r" \1 , "),
        (rf" (?:,|and|then|[.;])(?: and| then)* (?:come|go|head|return) back (?:for|to get|to fetch) ((?:the |that ){_NP})(?= (?:[.!] )?$)", _come_back),
        (rf" (?:build|make|give)(?: me| us)? a (?:stack|tower|pile) (?:with|of|from|out of|using) the (\w+) [:,] ((?:the )?{_KIND_OF}(?: (?:, and|,|and) (?:the )?{_KIND_OF})+)(?: ,)? (?:from )?(?:the )?(bottom|top) (?:up|down|to top|to bottom|to the top|to the bottom|upwards|downwards)(?= (?:[.!] )?$)", _bottom_up),
        # Where it was: "its old place", "the place where you found it".
        (r" (?:back )?(?:in|to|into|on|onto|at) (?:(?:its|their|his|her|the) )?(?:old|original|previous|former|earlier|initial|starting|first|prior|usual) (?:place|spot|position|location|home|seat|perch|site)(?= (?:and|then|[,.;!?]) | $)", " back where it was"),
        (r" (?:back )?(?:to |in |at |into )?(?:(?:the )?(?:exact |same |very )*(?:place|spot|position|location) )?(?:where|from which|from where|whence|that) (?:it|they|you|he|she) (?:came|come|comes|had come|originally came|was taken|were taken|got it|found it|took it|picked it up|fetched it|had it|was|were|stood|sat|started|started out|began|used to (?:be|stand|sit)|originally (?:was|stood|sat)|had been|had stood)(?: from| before| originally| at first| at the start| in the first place| to begin with)?(?= (?:and|then|[,.;!?]) | $)", " back where it was"),
        # An order as a noun: "give the can a lift", "do a pick of the can", "have a go at lifting it".
        (rf" (?:give|do|have|take|make|perform|execute|carry out)(?: me| us)? (?:a|an|one|the) {_ADJECTIVE}({_LIFT}|{_PUSH}|{_TAP}|{_OTHER})(?: up)?(?: of| to| on| at| for| with) (?!the (?:left|right|front|back|side) |left |right |me |us )(?=\w)", r" \1 "),
        (rf" (?:give|do|have|take|make|perform|execute)(?: me| us)? (?:a|an|one|the) {_ADJECTIVE}((?:pick|push|tap|lift|stack|swap|pour|plac|open|clos|slid|sort|pull|touch|mov|grabb|nudg)ing) of (?=\w)", r" start \1 "),
        (r" (?:have|take|try|give) (?:a|another) (?:go|shot|stab|crack|try|turn|bash|attempt|whirl) (?:at|of|with) (?=\w+ing )", " start "),
        (rf" (?:i|we) (?:want|need|would like|would love|require|demand|request|ask for) (?:a|an|one) {_ADJECTIVE}({_LIFT}|{_PUSH}|{_TAP}) (?:of|to|on|for) (?=the |a |that |this )", r" \1 "),
        (r" (?:top|crown|cap|cover|adorn|roof) ((?:the|a|that|this|my) (?:\w+ ){1,3}?)(?:off |over )?with (?=the |a |that |this |my )", r" put on \1, "),
        (r" (?:make|have|let|get) ((?:the |that |this )?" + _NP + r" and (?:the |that |this )?" + _NP + r") (?:to )?(?:swap|trade|change|switch|exchange)(?: their)?(?: places| positions| spots| seats| locations)?" + _END, r" swap \1"),
        # What only adds that it is enough, that it has to be, that any will do.
        (rf" ({_UNIT})(?: or so)?(?: ,)? (?:that )?(?:{_ENOUGH}){_END}", r" \1"),
        (rf" (?:,|and|but) (?:any|either|whichever|whatever|which|it does not matter which) (?:one |of (?:them|those|these|the two|the three|the lot) |{_WORD} )??(?:(?:is|are|will|would|works|suits|goes|will be|would be)(?: be| do)?(?: fine| okay| ok| good| alright| great)?(?: with me| by me| for me)?|you (?:like|want|fancy|please|prefer|choose|pick))(?: best| most)?{_END}", ""),
        (r" of your (?:own )?(?:choice|choosing|liking|preference|pick)(?= )", ""),
        (r" (?:of )?(?:whichever|whatever) (?:one |ones )?(?:you (?:like|want|fancy|please|prefer|choose|pick)|takes your fancy|suits you)(?: best| most)?(?= [,.;!?] | $)", ""),
        (rf" , you (?:{_SURELY} )?(?:have|need|must|got|ought)(?: got)?(?: to)? open (?:it|that|the drawer|the cabinet)(?: first| before| beforehand| up first| for that| of course| obviously)*{_END}", ""),
        (r" (?:,|and|but) (?:leave|keep|let|have) (?:the|that) (?:\w+ ){0,2}?(?:drawer|cabinet|cupboard) (?:stay )?open(?: after| afterwards| when (?:you are )?done| for now)?(?= [,.;!?] | $)", ""),
        (r" (?<!for )(?<!have )(?<!in )(?<!got )(?<!spare )(?<!take )(?<!wait )(?:a moment|a second|a sec|briefly|momentarily|quick quick|real fast|sharpish|double quick|like now|this very moment)(?= )", ""),
        (rf" (everything|anything|all|whatever|things?|stuff|those|the ones?|all the things?)((?: (?!,){_WORD}){{0,8}}) , {_NAMELY}(?: ,)? {_LISTED} ,(?= )", r" \3"),
        (rf" (?:all |both |the |every |each )(?!of ){_NP} , {_NAMELY}(?: ,)? {_LISTED} ,(?= )", r" \1"),
        # The end in place of the deed.
        (r"^ (.*) (?:is|that is) (?:what|all|how|where) (?:i|we) (?:want|need|would like|am after|ask|wish)(?: for| it| them)?(?= (?:[,.;!?] )?$)", r" i want \1"),
        (r" (?:(?:it )?would be (?:so |really |very |quite )?(?:nice|great|good|lovely|cool|wonderful|best|better|ideal|perfect|helpful|awesome|brilliant)|(?:i|we) would (?:be (?:glad|happy|pleased|delighted)|like it|love it|prefer it)) (?:if|were|to have|to see) (?=the |a |all |both |every|my )", " i want "),
        (r"^ (i want .*?) (?:had|held|contained) (?=the |a |all |both |every)", r" \1 to contain "),
        (rf" (?:i|we) (?:want|need|would like)(?: to (?:see|have))? (?=the )({_NP})(?: (?:left|to (?:stay|remain|be left)|remaining|staying|to be the one left))?(?: over| behind| out| here)? (?:on (?:the|my|this) {_ROOM_WORDS}|where it is)(?: ,| ;| [.])?(?: and| so)?(?: put| move| place)? {_OTHERS}", r" leave \1 , put everything else"),
        (rf" (?:leave|keep) (?=the )({_NP})(?: (?:on|at) (?:the|my|this) {_ROOM_WORDS})?(?: ,| ;| [.])?(?: and| but)?(?: put| move| place)? {_OTHERS}", r" leave \1 , put everything else"),
        (rf" no (?!touching )(?=\w+s )({_NP}) (?:left |remaining |lying |standing |around )*on the {_ROOM_WORDS}(?: any ?more| any longer)?(?: ,| and) (?:use|they (?:all )?go in|put them in(?:to)?|all in|into) (?=the |that |a )", r" put all the \1 in "),
        (r" (?:,|and|then) (?:use|using) (the (?:\w+ ){0,2}(?:basket|bin|box|bowl|tray|crate|bucket|container|tub|drawer|dish))(?: for (?:that|this|it|them))?(?= (?:[,.;!?] )?$)", r" into \1"),
        (rf" (?:and|,|then|while) (?=the |that |a |my )({_NP}) (?:joins|join|should join|can join|follows|goes with|accompanies|gets to join|keeps) (?:it|them|him|her)(?: there| in there| inside| in it| on it| too| company)*{_END}", r" , then \1"),
        (r" (?:you (?:can|may|should) )?(?:rest|relax|settle|wait|sleep|park|stay|retire|chill)(?: yourself| up| down)? (?:at|in)(?: your| the)? home(?: position| pose| base| spot)?(?= )", " go home "),
        (r" out of the way of (?:the|that|this|my) (?:\w+ ){1,3}?(?=(?:,|then|and|so|[.;!?]) |$)", " out of the way "),
        (r" (?:leave|keep|have) (it|them) (?:standing|sitting|lying|resting|there|waiting|parked|placed)(?: there)? (?=(?:to |on |in |at |next |beside |by |near |behind |left |right |between |over |atop |inside ))", r" put \1 "),
        (rf"^ ((?!stack |put |pile ){_NP}) on(?: top of| top)? ({_NP}) (?:as|in|into) a (?:tower|stack|pile)(?= )", r" stack \1 on \2"),
        (rf"^(.* (?:tower|stack|pile|on top).*?) , (?:with )?(?:the )?({_NP}) (?:last|finally|at last|to finish)(?= (?:[,.;!?] )?$)", r"\1 with the \2 on top"),
        (rf"^(.* (?:tower|stack|pile).*?) , (?:with )?(?:the )?({_NP}) first(?= (?:[,.;!?] )?$)", r"\1 with the \2 at the bottom"),
        (r" (\w+) as (?:a|an) (?:\w+) (?=thing |one |object |item )", r" \1 "),
    )
)  # fmt: skip


def spelled_out(tokens: Sequence[Token]) -> tuple[Token, ...]:
    """Return the tokens with what the grammar would read as something else in plain words.

    Among towers "over" is "on", a position elsewhere; in "stack the dice, white on red" both colours are of dice; in
    "the red cup where the blue one is and the blue one where the red one was" the two change places; and "the dice in
    the bowl, both of them" asks once.
    """
    words = {token.text for token in tokens}
    made = list(tokens)
    if "over" in words and words & {"tower", "stack", "pile"}:
        for k in range(1, len(made) - 1):
            if made[k].text == "over" and made[k + 1].text not in (
                "there",
                "here",
                "to",
                "the",
                "on",
                "by",
                "at",
                "in",
            ):
                made[k] = Token("on", made[k].raw, "word")
    return _applied(_SPELLED, made) if words & {"stack", "pile", "where", "both"} else tuple(made)


def rephrased(tokens: Sequence[Token]) -> tuple[Token, ...]:
    """Return the tokens with what has a plainer wording in that wording; the same tokens if there is none."""
    return _applied(_RULES, tokens, plainly)


def _applied(
    rules: Sequence[tuple[re.Pattern[str], Replacement]],
    tokens: Sequence[Token],
    first: Callable[[str], str] = str,
) -> tuple[Token, ...]:
    if any(" " in token.text for token in tokens):
        return tuple(tokens)
    text = before = f" {' '.join(token.text for token in tokens)} "
    text = first(text)
    for pattern, replacement in rules:
        text = pattern.sub(replacement, text)
        if not text.endswith(" "):
            text += " "
    if text == before:
        return tuple(tokens)
    known = {token.text: token for token in tokens}
    made: list[Token] = []
    for word in text.split():
        if word in MARKS and (not made or made[-1].text in MARKS):
            continue
        made.append(known.get(word) or Token(word, word, "mark" if word in MARKS else "word"))
    return tuple(made)
