"""From text as it is typed to plain words and marks: contractions, slips that run together, bullets, arrows, brackets."""

from __future__ import annotations

import re
import unicodedata

from robosandbox.agent.language import lazy_regex
from robosandbox.agent.language.notation import in_steps

_SOME = r"(?:the|those|these|my|your|red|green|blue|yellow|orange|purple|pink|brown|black|white|gr[ea]y)\b(?! (?:other|rest)\b)"
"""How those are named that alone are meant."""
_WAY = r"(away from (?:you|me)|towards? (?:you|me)|forwards?|backwards?|back|left|right)\b"
_OWN_HAND = r"(?:the|your) (?:gripper|hand|fingers|claw)"
_DOING = r"(?:put|place|take|grab|get|move|push|pour|stack|tap|lift|pick|set|drop|open|close|lay|stand|bring|touch|slide|tip)\b"


def _which_one(match: re.Match[str]) -> str:
    """Return "the red one next to the duck" as "the cup, not the car" has it: another place if that is denied, else what the one is."""
    colour, place, said, denied = match.groups()
    words = place.split()
    if denied in words:
        return f"the {colour} one " + " ".join(said if word == denied else word for word in words)
    return f"the {colour} {said}{place}"


_CONTRACTIONS = [
    (lazy_regex.compile(pattern), replacement)
    for pattern, replacement in (
        (r"\b(do|does|did|is|are|should|could|would|must|was|were|have|has|had)n'?t\b", r"\1 not"),
        (r"\bcan'?t\b|\bcannot\b", "can not"),
        # "maybe put the ball in the bin?" asks politely; without the question mark nobody has decided yet.
        (rf"^(?:maybe|perhaps|possibly),? (?={_DOING}[^.;!?]*\?\s*$)", "could you "),
        (r"\bwon'?t\b", "will not"),
        (r"\bshan'?t\b", "shall not"),
        (r"\blet'?s\b", "let us"),
        (r"\b(i|you|we|they|that|it)'d\b", r"\1 would"),
        (
            r"\b(tap|touch|pat|poke|press|boop|bop)( on)? ([a-z_ ]{3,30}?)'s? (?:top|head|lid|cap|nose|surface|upper side)\b",
            r"\1 \3",
        ),
        (r"\b(must|should|shall) to\b", r"\1"),
        (r"\bno (touch|touchy|bump|disturb|want|like)\b", r"do not \1"),
        (
            r"\b(?:it )?would be (?:so |really |very |quite )?(?:nice|great|good|lovely|cool|wonderful|best|ideal|perfect) if (?=the |a |all |both )",
            "i want ",
        ),
        (r"\b(i|you|we|they|that|it)'ll\b", r"\1 will"),
        (r"\b(i|you|we|they)'ve\b", r"\1 have"),
        (r"\b(you|we|they)'re\b", r"\1 are"),
        (r"\bi'm\b|\bim\b", "i am"),
        (r"\b(that|it|what|whatever|who|where|there|which|here|how|he|she)'s\b", r"\1 is"),
        (r"\b(thats|whats|wheres|whos)\b", lambda match: match[0][:-1] + " is"),
        (r"\b(id) (like|love|want|prefer)\b", r"i would \2"),
        (r"\binfront\b", "in front"),
        (r"\bontop\b", "on top"),
        (r"\binbetween\b", "in between"),
        (r"\bnextto\b", "next to"),
        (r"\b(\w+)'s (?=(?:on|in|inside|under|behind|beside|next to|gone|not|out of)\b)", r"\1 is "),
        # A "but" that begins a sentence says nothing, unless it leaves something out.
        (r"^\W*but (?:for )?((?:the|my) [a-z_ ]{2,30}?), (?=(?:all|every|each|everything)\b)", r"except for \1, "),
        (
            r"\b(\w+)'s (?=(?!thing|ring|string|wing|earring|sling|spring|ceiling|clothing|washing|racing)(?:\w{2,}ing|been|had|made|got|come|become|lost|just|so|too|really|very|completely|totally|always|already|about|a bit|a little|kind of|sort of|all|ours|on (?:his|her|my|their|holiday|leave|break|it)|wet|hot|cold|ready|sticky|heavy|filthy|gross|poorly)\b)",
            r"\1 is ",
        ),
        (r"\b(she|he)'d\b", r"\1 would"),
        (r"\b(she|he)'ll\b", r"\1 will"),
        (r"'cause\b|\bcause\b(?= (?:i|it|we|he|she|they|my|the|that|this)\b)", "because"),
        (r"\b(you|they)re\b", r"\1 are"),
        (
            r"\b(\w+)'s (?=(?:empty|full|open|closed|shut|broken|dirty|done|finished|dead|old|rotten|mine|yours)\b)",
            r"\1 is ",
        ),
        (r"\bsh(?:u|ou|l)d\b", "should"),
        (r"\bc(?:u|ou|l)d\b", "could"),
        (r"\bw(?:u|ou|l)d\b", "would"),
        (r"\bdnt\b", "do not"),
        (r"\b(in|on)2\b", r"\1to"),
        (r"\b((?:open|close|shut)(?: up)? (?:the|teh|my|that)) draw\b", r"\1 drawer"),
        (r"\bnext too(?= \w)", "next to"),
        (r"\b2 (?=(?:the|teh|da|my)\b)", "to "),
        (r"\b4 (?=(?:me|us)\b)", "for "),
        (r"\bfwds?\b", "forward"),
        (r"\bb(?:c?k)?wds?\b", "backward"),
        (r"\bpos\b(?!\s*\()", "position"),
        (r"\bw/o\b", "without"),
        (r"\bw/", "with "),
        (r",\s*(?:all|both) of (?:them|those|these)\s*,", ","),
        (r"(?<=[,;.]) (and )?rest (?=(?:in|into|to|on|onto|goes|go|belongs|belong)\b|[-=]+>|[→⇒➔])", r" \1the rest "),
        (r"\band rest (?=(?:in|into|to|on|onto|goes|go)\b|[-=]+>|[→⇒➔])", "and the rest "),
        (r",\s*also ((?:the |a |my )?\w+(?: \w+)?),? and (?=the |a |my )", r" ; \1 ; and "),
        (r"[.,;!]\s*(?:that is |oh )?wrong\s*[,.!]\s*", ", no, "),
        # "to the right, er, to the left"
        (
            r"\b(to|in|into|on|onto|behind|beside)((?: \w+){1,4})(?<! the)(?<! a),? (?:er+m?|uh+m?|um+|hm+|ah|oops),? (?=\1 )(?!.*\bi mean)",
            r"\1\2, no, ",
        ),
        # "away from you, er, towards you"
        (
            rf"\b{_WAY},? (?:er+m?|uh+m?|um+|hm+|ah|oops),? (?={_WAY}(?! of\b))",
            lambda match: f"{match[1]}, no, ",
        ),
        # "the cans in the box, but only the tall one": those alone; `colloquial` says what that means.
        (
            rf"(?<!no)(?<!nah)(?<!sorry)(?<!wait)(?<!actually)\s*[,;-]?\s*\b(?:but|and) (?:only|just) (?={_SOME})",
            " , namelyonly ",
        ),
        (
            rf"^(?!.*\b(?:no|nah|wait|sorry|leave|forget|oops|actually)\b)(.*\w), (?:only|just) (?={_SOME}[^,.;]*[.!]?\s*$)",
            r"\1 , namelyonly ",
        ),
        (
            r"\b(no|sorry|i mean|wait),? (?:only|just) (?=(?:the|those|these) [a-z ]{2,30} (?:in|into|on|onto|to)\b)",
            r"\1 , namelyonly ",
        ),
        (r"\bi (?:(?:only |just )?want(?:ed)?|wished) to say\b", "i meant"),
        # There and back is no way that a push goes.
        (r"(,|\band)( then)? back again\b", r"\1\2 backagain"),
        (r"(?<=\w)[,;.]?\s*\bbut,? before you do(?: that| it| so)?\b,?", ", but first"),
        (
            r"(?<=\w)\s*[.;,!]\s*(?:oh,? |no,? |actually,? |wait,? )*never ?mind(?: that| it)?\s*[,.;!:]+\s*(?=\w)",
            ", scratch that, ",
        ),
        # "I'm going to put the jam on the tray, you take the bread": who speaks does the one.
        (r"^i(?:'m| am) (?:going to|gonna) (?:(?!\byou\b)[^,.;])*[,.;] (?:and |so |then )*(?=you \w)", ""),
        # "tap the can again and again": nobody says how often.
        (r"\b(?:again and again|over and over)\b(?: again\b)?", "repeatedly"),
        # "tap the can, and do it again"; after more than one thing to do, which of them?
        (
            r"^((?:(?! and | then |[,.;]).)*\w)[,.;]?\s*(?:and |then |and then )?do (?:it|that|this) (?:again|once more|one more time)(?=[.! ]*$|,? (?:if|please|for|when|thanks)\b)",
            r"\1 twice",
        ),
        (r"\bdo (?:it|that|this) (?:all )?(?:again|once more|one more time)\b", "repeat that"),
        (
            r"^((?:(?! and | then |[,.;]).)*\w),? (?:and|then|and then) (?:again|once more|one more time)(?=[.! ]*$|,? (?:if|please|for|when|thanks)\b)",
            r"\1 twice",
        ),
        # Sides count before words are spelled right: "to the left, the blue one to the rihgt of the bowl".
        (r"\b(?:elft|lfet|letf)\b", "left"),
        (r"\b(?:irght|rgiht|rihgt|rigth)\b", "right"),
        # "the red cube left and the blue one right of the bowl"
        (
            rf"\b(?:to the |on the )?(left|right)(?: and|, and|,) ((?:the |a )?(?:(?!\b(?:then|after|next|{_DOING}))[a-z_ ]){{2,30}}?) (?:to the |on the )?(left|right) of ((?:the |a |my )?\w+(?: (?!if|please|and|then|for)\w+)?)(?=\s*(?:[,.!;]|$|\b(?:and|then|if|please|for)\b))",
            r"to the \1 of \4 and \2 to the \3 of \4",
        ),
        (
            r"\bin front(?: and|, and|,) ((?:the |a )?[a-z_ ]{2,30}?) behind ((?:the |a |my )\w+(?: (?!if|please|and|then|for)\w+)?)(?=\s*(?:[,.!;]|$|\b(?:and|then|if|please|for)\b))",
            r"in front of \2 and \1 behind \2",
        ),
        (
            r"\bbehind(?: and|, and|,) ((?:the |a )?[a-z_ ]{2,30}?) in front of ((?:the |a |my )\w+(?: (?!if|please|and|then|for)\w+)?)(?=\s*(?:[,.!;]|$|\b(?:and|then|if|please|for)\b))",
            r"behind \2 and \1 in front of \2",
        ),
        (r"\bur (?=at it\b)", "you are "),
        # "the pear too, the plum in the bowl": with what comes before.
        (
            r"(?<=\w) (?:too|as well|also)\s*,(?!\s*(?:please|thanks|thank|then|and then|but|not|except|without)\b)",
            " ;",
        ),
        (r"(?<=\w) (?:too|as well),? and (?=the |a |all |both |my |your )", " ; and "),
        # What "please" and "now" make an order, without which it would tell what was done.
        (r"^\W*(?:some|any)(?:one|body),? please,? (?=\w)", "please "),
        (rf"(^|[.;!?]\s*)(?:(?:and|so|then|ok|okay|well|right|alright),? )*now,? (?:then,? )?we (?={_DOING})", r"\1"),
        (r"([,;.]\s*(?:and )?)than\b", r"\1then"),
        (r"\ba (?:teeny|teensy|tiny|wee)[ -]?(?:weeny|weensy|tiny|little|wee)? bit\b", "a tiny bit"),
        (r"\bgonna\b", "going to"),
        (r"\bgimme\b", "give me"),
        (r"\blemme\b", "let me"),
        (r"\b(wanna)\b", "want to"),
        (r"\bgotta\b", "got to"),
        (r"\b(u|ya)\b", "you"),
        (r"\bur\b", "your"),
        (r"\bda\b", "the"),
        (r"\b(can|could|do|are) (you) (?:actually|really)\b", r"\1 \2"),
        (rf"\b(open|close) and (open|close) ({_OWN_HAND})\b", r"\1 \3 and \2 \3"),
        # "with 5 N for two seconds".
        (r"\b(with|at) (\d+(?:\.\d+)?) ?n\b(?= )", r"\1 \2 newtons"),
        (r"\b(n|an')\b(?= )", "and"),
        (r"\bcuz\b|\bcos\b|\bcoz\b", "because"),
        (r"\bluv\b", "love"),
        (r"\bi\.e\.?,?|\bthat is,|\bthat is to say,?|\bnamely\b", ","),
        (r"([+-]) ?([xy])\b", lambda match: f"{'positive' if match[1] == '+' else 'negative'} {match[2]}"),
        (r"\.{2,}(?=\s*\S)", " , "),
        # "the red one next to the duck, the cup I mean, not the car": what the one is, where it is no word for the place.
        (
            r"\bthe (\w+) one\b((?:(?!\b(?:ones?|then|and|no)\b)[^.;!])*?),? (?:i mean(?:t)? )?the (\w+),? (?:(?:i mean(?:t)?|that is),? )?not the (\w+)(?=[.! ]*$)",
            _which_one,
        ),
        # "the... bowl! yes, the bowl": said over again, and meant once.
        (
            r"\b((?:the |my )?\w+(?: \w+)?)\s*[,.!;]+\s*(?:oh,? )?(?:yes|yeah|yep|yup)[,!.]*\s+(?:(?:in|on|into|onto|to) )?(?:the |my )?(?<=\W)\1(?=[ ,.!;]*$)",
            r"\1",
        ),
        # "the red crate is only for red things, so put the green box in the other one" asks for one thing.
        (
            rf"^((?:the|my|our) [a-z_ ]{{2,30}}?) (?:is|are) (?:(?:only|just|strictly|reserved|exclusively) for [a-z_ ]{{2,30}}?|for [a-z_ ]{{2,30}}? (?:only|alone|exclusively)),?;?\.?,? (?:so,? |and so |please |therefore )*(?={_DOING})(?!.*\b(?:it|there|only|just|for)\b)(?!.*\1)",
            r"do not use \1. ",
        ),
        (r"(^|\b(?:you|to|please)\s+)be an? (?:\w+ )?\w+ and\b", r"\1"),
    )
]
_GROUP = lazy_regex.compile(r"\((?:\\.|\[(?:\\.|[^\]\\])*\]|[^()\[\\])*\)(?:[*+?]|\{[^}]*\})*")
_NO_LITERAL = lazy_regex.compile(r"(?:\\.|\[(?:\\.|[^\]\\])*\]|.(?=[*+?{])|[.^$])(?:[*+?]|\{[^}]*\})*")


_CHOICE = lazy_regex.compile(r"(?<!\\)\((?:\?:)?([^()?][^()]*)\)(?![*?{])")


def _cues(pattern: str) -> tuple[str, ...]:
    """Return pieces of text one of which is in whatever a pattern finds.

    Of each alternative its longest plain piece outside groups, or where that says little, those of a group that must be there.
    """
    bare, groups = pattern, 1
    while groups:
        bare, groups = _GROUP.subn("\n", bare)
    ways = bare.split("|")
    cues = tuple(map(_plain_piece, ways))
    if len(ways) > 1 or len(cues[0]) > 2:
        return cues
    choices = [tuple(map(_plain_piece, choice[1].split("|"))) for choice in _CHOICE.finditer(_outside(pattern))]
    return max((cues, *choices), key=lambda each: min(map(len, each)))


def _plain_piece(pattern: str) -> str:
    return max(_NO_LITERAL.sub("\n", pattern).split("\n"), key=len)


def _outside(pattern: str) -> str:
    """Return a pattern without the groups that hold others, or that look around."""
    made, depth, start = "", 0, 0
    for k, letter in enumerate(pattern):
        if letter == "(" and pattern[k - 1 : k] != "\\":
            start = k if depth == 0 else start
            depth += 1
        elif letter == ")" and pattern[k - 1 : k] != "\\":
            depth -= 1
            group = pattern[start : k + 1]
            made += (
                group if depth == 0 and group.count("(") == 1 and not group.startswith(("(?=", "(?!", "(?<")) else ""
            )
        elif depth == 0:
            made += letter
    return made


_CUED = [(_cues(pattern.pattern), pattern, replacement) for pattern, replacement in _CONTRACTIONS]
_MARKS = str.maketrans(
    {
        "’": "'",
        "‘": "'",
        "`": " ",
        "“": " ",
        "”": " ",
        "«": " ",
        "»": " ",
        "–": ",",
        "—": ",",
        "…": ",",
        "&": " and ",
        "×": "x",
        "−": "-",
    }
)
_BRACKETS = str.maketrans({"(": ",", ")": ",", "[": ",", "]": ","})
_BULLETS = lazy_regex.compile(r"(?:^|\n)\s*[-*•]+\s+|(?<!\w)\*+|\*+(?!\w)")
_DECIMAL_COMMA = lazy_regex.compile(
    r"(?<!at )(?<![\d,.(])(\d+),(\d+)(?=\s?(?:cm|mm|m|centi\w+|milli\w+|met\w+|inch\w*)\b)"
)
_ARROWS = lazy_regex.compile(r"\s*(?:-+>|=+>|→|⇒|➔|>>+)\s*")
_ITS_SIDE = lazy_regex.compile(
    r" (?:over )?(?:on|to|at|by)(?: to)? ((?:the |that |this |my )?(?!robot|arm|table|desk|your|you)[a-z_]+(?: (?!robot|arm|table|desk)[a-z_]+)?)'s (left|right)(?:[- ]?hand)?(?: side)?\b"
)


def plain_text(text: str) -> str:
    """Return a text in lower case, in full words, without accents, with one kind of each mark."""
    text = text.translate(_MARKS).lower()
    if not text.isascii():
        text = "".join(c for c in unicodedata.normalize("NFKD", text) if not unicodedata.combining(c))
    for cues, pattern, replacement in _CUED:
        for cue in cues:
            if cue in text:
                text = pattern.sub(replacement, text)
                break
    text = _ARROWS.sub(" to ", re.sub(r"\s*(?:<-+>|<=+>|↔|⇄)\s*", " and ", text))
    text = re.sub(r'(?<=\d)\s?(?:"|\'\')', " inches ", text).replace('"', " ")
    text = _DECIMAL_COMMA.sub(r"\1.\2", _BULLETS.sub(" , ", text))
    text = re.sub(r"(?<=\s)-+(?=\s)", ",", text)
    text = re.sub(r"\(([^()]*\d[^()]*)\)", r" \1 ", text).translate(_BRACKETS)
    text = _ITS_SIDE.sub(r" to the \2 of \1", text)
    text = re.sub(r"'s\b", "", text).replace("'", " ")
    text = re.sub(r"(?<=[a-z])-(?=[a-z])|(?<=\d)-(?=[a-z])", " ", text)
    return text


def in_sentences(text: str) -> str:
    """Replace "a) ... b) ...", "1. ... 2. ...", "... stop ... stop" by sentences."""
    return in_steps(text)
