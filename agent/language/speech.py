"""The words around a command: politeness, wishes, joints between steps, prohibitions, corrections.

Each table maps what people say to one canonical value. Multi-word entries are matched whole.
"""

from __future__ import annotations

from itertools import product

from robosandbox.agent.language.wordlist import word_set

FILLERS = (
    "please, pls, plz, plase, kindly, um, umm, uh, uhh, uhm, er, erm, err, hmm, hm, mmm, ah, oh, okay, ok, "
    "no hurry, no rush, okey, okie, hey, hi, hello, yo, "
    "centre to centre, center to center, measured centre to centre, measured center to center, "
    "pretty pretty please, pretty please, vroom, beep, beep beep, whoops, whoopsie, oopsie, wow, yay, hooray, hurray, woohoo, yippee, boom, wheee, "
    "hey there, hi there, hello there, good morning, good afternoon, good evening, greetings, dear, "
    "hey robot, hi robot, hello robot, ok robot, okay robot, dear robot, mr robot, hey arm, robot friend, "
    "buddy, mate, pal, dude, bro, bruv, man, friend, my friend, bot, "
    "now, just, simply, "
    " thanks, thank you, thank you very much, thanks a lot, many thanks, thx, ty, cheers, "
    "ta, much appreciated, "
    "if you please, if you like, if you want, if you wish, if you do not mind, if possible, if that is okay, if that is ok, if that is possible, "
    "if you have a moment, if you have time, if it is not too much trouble, if it is no trouble, "
    "if you would be so kind, "
    "when you get a chance, when you have a moment, when you have time, when you can, when you are ready, "
    "whenever you are ready, when possible, "
    "pretty please, "
    "right now, right away, straight away, immediately, asap, at once, this instant, "
    "this minute, "
    "alright, all right, basically, literally, honestly, "
    "quite, really, directly, simply, there is a good robot, there you go, "
    "with the gripper, with your gripper, using the gripper, using your gripper, with the arm, with your arm, "
    "using your arm, with your claw, using the arm, with the claw, "
    "with your hand, with the hand, using your hand, with your robotic arm, in one go, in that order, in this order, "
    "like so, you know, i think, "
    "right there, "
    "that would be great, that would be lovely, that would be nice, would be great, would be nice, "
    "would be lovely, much obliged, "
    "good robot, be a dear, be a dear and, be a darling and, be a love and, be an angel and, be a sweetheart and, be a good lad and, under any circumstances, whatever happens, be so kind as to, be so kind to, be so kind and, be kind enough to, be a good robot and, "
    "do me a favor and, do me a favour and, do me a favor, do me a favour, "
    "there is a dear, darling, sweetheart, lad, sir, madam, "
    "one at a time, one by one, one after another, one after the other, in turn, mister, mister robot, mr, "
    "step by step, task, next task, your next task, command, instruction, then please, so please, simple task, "
    "yeah, yep, yup, good job, well done, lol, haha"
)
DEGREES = word_set("nearly almost hardly barely scarcely")
"""Words that no slip of the pen turns into others."""
LIMITS = "only, also, too, as well, for me, for us"
"""A plan does no more than it is asked for, for whoever asks; a question is another one without it."""
REPEATS = "again, one more time, once again, once more"
RATHER = "instead"
"""Said of what was done before, in the same breath or the one before."""
_ADVERBS = (
    "carefully|gently|slowly|quickly|fast|softly|smoothly|lightly|delicately|tenderly|cautiously|swiftly|rapidly|promptly|firmly|"
    "safely|precisely|neatly|nicely|properly|quietly|silently|calmly|steadily|slow|quick|easy"
)
MANNERS = "".join(
    f", {' '.join(words)}"
    for said in (
        (
            "steady|easy does it|careful now|steady now|gently now|be careful|be gentle|take care|take your time|in slow motion",
        ),
        ("for a", "moment|second|sec"),
        ("with care|with great care|without a sound|without noise|without a noise|with no noise",),
        ("hurry up and|hurry up|hurry|chop chop|on the double|pronto|step on it|get a move on and|get a move on",),
        (
            "make it snappy|and make it snappy|make it quick|and make it quick|be quick|and be quick|be quick about it|and be quick about it",
        ),
        ("at|with", "full|top|half|low|high|maximum|minimum", "speed"),
        (_ADVERBS,),
        ("very|very very|really|real|nice and|so", _ADVERBS),
        ("as", _ADVERBS, "as", "you can|possible|you are able to"),
        ("but not too|not too|and not too", "hard|fast|quickly|firmly|tight|tightly|roughly"),
    )
    for words in product(*(part.split("|") for part in said))
)
"""Words of speed and care, which no skill is told: a plan is made, and its note says so."""
PREAMBLES = (
    "you please, please you, now you, you now, "
    "you are welcome to, be sure and, why do not we, i would say, we could, we can, let us say, i would suggest you, i suggest you, i suggest that you, i want to see you, i would love to see you, i need to see you, i would like you to please, you, you might, could you maybe, could you perhaps, could you possibly, can you maybe, can you perhaps, can you possibly, would you maybe, would you perhaps, maybe you could, perhaps you could, maybe you can, perhaps you can, so if you could, would it be okay to, would it be ok to, would it be alright to, is it okay to, is it ok to, the next step is to, "
    "the first step is to, i would appreciate it if you, it would be great if you, it would help if you, i would like it if you, "
    "mind, if you could, if you would, if you can, i would love it if you could, i would love it if you would, "
    "it would be great if you could, it would be nice if you could, it would be lovely if you could, "
    "it would be great if you would, would you be able to, would you be so kind as to, i am asking you to, "
    "what about, "
    "can you, could you, would you, will you, can ya, could ya, can u, could u, can we, could we, shall we, "
    "would you mind, do you mind, would u, will u, "
    "i want you to, i would like you to, i need you to, i would love for you to, i would love you to, "
    "i want to have you, i would like to have you, i ask you to, "
    "i would appreciate it if you could, i would appreciate it if you would, i would be grateful if you could, "
    "i would be happy if you could, "
    "i was wondering if you could, i wonder if you could, i was hoping you could, "
    "i was wondering if you would, i would like for you to, i wanna see you, i would like to see you, "
    "you should, you can, you could, you must, you need to, you have to, you may, you are to, you will, "
    "your task is to, your job is to, the task is to, your goal is to, your mission is to, your assignment is to, "
    "what i need is for you to, what i want is for you to, what i would like is for you to, what i need you to do is, "
    "what i want you to do is, what i would like you to do is, what you need to do is, what you have to do is, "
    "what you should do is, all i want is for you to, all you need to do is, all you have to do is, "
    "so what i need is for you to, so what i want is for you to, so what i want you to do is, "
    "so what i need you to do is, so what i would like you to do is, the thing to do is, the plan is to, "
    "the idea is to, we are going to, you are going to, let us go and, "
    "go ahead and, go ahead, try to, try and, try, attempt to, make sure to, make sure you, "
    "make sure that you, be sure to, be sure you, remember to, "
    "do not forget to, let us, how about you, how about, why do not you, why not, what about you, proceed to, "
    "start by, begin by, "
    "start off by, begin with, start with, start, begin, continue by, finish by, end by, finish off by, "
    "go on and, go and, go, feel free to, it is time to, time to, i say, i said, "
    "please do, do, would it be possible to, would it be possible for you to, is it possible to, "
    "is it possible for you to, are you able to, "
    "may i ask you to, might you, can i ask you to, could i ask you to, can i get you to, could i get you to, "
    "may i trouble you to, "
    "i asked you to, i told you to, i require you to, i request you to, i request that you, i ask that you, i want that you, "
    "i hereby order you to, i command you to, i order you to, "
    "we need to, we have to, we want to, we should, let me see you, let me have you, we need you to, "
    "we want you to, we would like you to, "
    "off you go and, you would better, you had better, you better, you might want to, you should be, finish up by, end up by, like, to, see that you, so, well, alright then, right then, right, all i want is for you to, all you need to do is, "
    "all you have to do is, what i want you to do is, what i need you to do is, "
    "the next thing to do is, next you should, next thing is to, you are going to, you wanna, you gotta, "
    "you got to, kindly do, do please, "
    "i am going to need you to, i am gonna need you to, gonna need you to, help me, help me to, "
    "help me out and, help by, help, could you help me, use the gripper to, use your gripper to, "
    "use your arm to, use the arm to, "
    "turn around and, manage to, quickly go, be a good sport and, want you to, need you to, would like you to, "
    "would love you to, robot, arm"
)
DESIRES = (
    "show me, let me see, time for, it is time for, it is time, it is time that, high time for, what i need is for, what i want is for, all i want is for, all i need is for, all i ask is for, what i would like is for, what i want is, what i need is, all i want is, all i need is, what i would like is, i will have, i will take, i will need, i am going to need, i am gonna need, make, let, i want, i need, i would like, i would love, i require, i want to have, i would like to have, "
    "i need to have, i want to see, "
    "i would like to see, make sure, make sure that, ensure, ensure that, see to it that, we need, we want, "
    "we would like, "
    "i would prefer, let us have, let us get, can i have, could i have, may i have, can we have, "
    "could we have, can i get, could i get, have, get, i wish, "
    "i expect, i would like it if, it would be nice if, let me have, see that, i wanna have, i wanna see, "
    "i wanna, i like, the goal is to have, "
    "the goal is for, the goal is to get, we would love, would like, need, want"
)
OWN_WISHES = (
    "i want to, i would like to, i would love to, i need to, i have to, i wish to, i am going to, i am trying to, i must, i should, "
    "we would like to, we have to, we must, we should, i want us to, i like to"
)
"""What a person means to do, and does through the arm."""
_GOALS = "goal, aim, objective, target, desired outcome, outcome, end result, result, desired state, final state, end state, desired result, idea, intention, wish"
DESIRES += "".join(
    f", {whose} {goal} {is_}"
    for goal in _GOALS.split(", ")
    for whose in ("the", "my", "your", "our")
    for is_ in ("is", "should be", "is to have", "is to see", "is to get", "is that", "is for", "is having", "would be")
)
DESIRES += (
    ", it would be great if, it would be good if, it would be lovely if, it would be best if, i would be glad if, it would help if, would be great if, "
    "it would be better if, i would prefer it if, i would love it if, i would appreciate it if, i want that, it is necessary that, "
    "make it so, make it so that, make it such that, arrange things so that, arrange it so that, set things up so that, "
    "arrange things so, fix it so that, arrange for, see to it, it is important that, i would be happy if, be sure that, "
    "i am after, i would rather have, i should like, i would like there to be, there should be, there needs to be, i want there to be"
)

COPULAS = (
    "is to be, are to be, to lie, to stand, to rest, has to be, have to be, should get, must get, to be, be, should be, should go, must be, must go, needs to be, need to be, needs to go, "
    "need to go, goes, go, belongs, belong, to go, "
    "lives, live, ends up, end up, to end up, sits, sit, to sit, should sit, should end up, has to be, has to go, "
    "have to go, have to be, gets, is to go, "
    "sitting, resting, to come, comes, should come, should rest, to rest, ought to be, ought to go, will go, "
    "can go, could go, would go, standing, lying, "
    "wants to sit, want to sit, wants to go, want to go, would like to sit, would like to be, "
    "to stand, should stand, is supposed to be, is supposed to go, are supposed to go, is meant to be, "
    "is meant to go, wants to be, wants to go, has gotta be, gotta be, gotta go"
)
COPULAS += ", would look good, would look nice, would look great, would look better, would be better, would be better off, would fit nicely, would be best, would be nice, would be great"
COPULAS += "".join(
    f", {modal} {verb}"
    for modal in [
        "should",
        "must",
        "shall",
        "will",
        "has to",
        "have to",
        "needs to",
        "need to",
        "ought to",
        "is to",
        "are to",
        "is supposed to",
        "are supposed to",
        "is meant to",
        "are meant to",
        "had better",
        "would better",
        "wants to",
        "want to",
        "is going to",
        "are going to",
    ]
    for verb in [
        "be",
        "go",
        "sit",
        "stand",
        "rest",
        "lie",
        "end up",
        "come",
        "land",
        "get",
        "live",
        "belong",
        "finish up",
        "stay",
    ]
    if verb != "stay"
)
IS = (
    "that looks, which looks, that look, which look, looking, that seems, that appears, that is, which is, that are, which are, that sits, which sits, that lies, which lies, that stands, "
    "which stands, who is, "
    "sitting, lying, standing, placed, located, resting, positioned, situated, found, that is sitting, "
    "that is lying, that is standing, "
    "which is sitting, which is lying, which is standing, that is resting, which is resting, that is placed, "
    "that is located, which is located, that is currently, which is currently, currently, "
    "that you see, you see, that you can see, you can see, that we have, we have, that i see, i see, "
    "that are currently, laying, that is laying, which is laying, stacked, stored, kept, "
    "that are sitting, that are lying, that are standing, that are located, which are sitting, over, "
    "that rests, that is found, that has been placed, "
    "that is the, which is the, that are the, nearby, being, that lie, that sit, that stand, "
    "that you will find, you will find, that you have, you have, that is positioned, "
    "that is stacked, which is stacked, that are stacked, that is situated, that was placed, directly, right, "
    "just, immediately"
)
NOT_IS = (
    "which is neither, that is not, which is not, that are not, which are not, that do not, is not, not, that is neither, "
    "which are neither, that are neither"
)
EXCEPT = (
    "except, except for, but, but not, other than, apart from, besides, excluding, save for, aside from, "
    "with the exception of, minus, not counting, barring, and not, but skip, but leave out, bar, "
    "not including, without, but without"
)
_COLLIDE = {
    "touch": "touching", "move": "moving", "disturb": "disturbing", "bump": "bumping", "bump into": "bumping into",
    "hit": "hitting", "knock": "knocking", "knock over": "knocking over", "knock into": "knocking into",
    "brush": "brushing", "brush against": "brushing against", "graze": "grazing", "jostle": "jostling",
    "clip": "clipping", "run into": "running into", "crash into": "crashing into", "collide with": "colliding with",
    "scrape": "scraping", "catch": "catching", "shift": "shifting", "topple": "toppling", "tip over": "tipping over",
}  # fmt: skip
_CAREFUL = (
    "do not", "and do not", "but do not", "never", "but never", "be careful not to", "be careful you do not",
    "take care not to", "take care you do not", "try not to", "make sure not to", "make sure you do not",
    "be sure not to", "mind you do not", "mind not to", "see that you do not", "watch you do not", "you must not",
    "must not", "you should not", "should not", "you may not", "you can not", "you are not allowed to",
    "i do not want you to", "you do not need to", "you do not have to", "no need to", "do not ever", "do not even",
)  # fmt: skip
_SIDEWAYS = ("brushing", "grazing", "jostling", "clipping", "running", "crashing", "scraping", "catching")
_LEAVING = (
    "avoid",
    "avoiding",
    "refrain from",
    "stop",
    "quit",
    "not",
    "but avoid",
    "and avoid",
    "while avoiding",
    "while not",
)
AVOID = (
    "keep, spare, without touching, without bumping, without bumping into, without hitting, without knocking, "
    "without picking up, without pushing, without using, without affecting, without colliding with, "
    "while avoiding, avoiding, avoid, but leave, do not mess with, do not go near, leave, stay away from, keep away from, "
    "stay clear of, steer clear of, keep clear of, keep your hands off, hands off, ignore, skip, "
    "forget, forget about, never mind, do not bother with, do not worry about, no touching, no moving, "
    "keep off, let it be, keep clear from, mind, watch out for, careful with, be careful with, be careful of, "
    "and leave, while leaving, leaving, without interfering with, with no contact with, "
    "but avoid, and avoid, but ignore, but stay away from, but keep away from"
    + "".join(f", {careful} {verb}" for careful in _CAREFUL for verb in (*_COLLIDE, "use", "make use of"))
    + "".join(f", {leaving} {doing}" for leaving in _LEAVING for doing in _COLLIDE.values())
    + "".join(f", without {doing}" for doing in _COLLIDE.values() if doing.split()[0] in _SIDEWAYS)
)
AVOID_TAILS = (
    "out here, where it is now, where they are now, on the table, outside, behind, as they were, over there, over here, alone, here, put, right there, where he is, be, where it is, where they are, where it stands, in place, in its place, as it is, untouched, "
    "as is, there, undisturbed, in peace, out of it, out of this, still, at all, unmoved, where it was, "
    "as they are, in their place, out, over, under any circumstances, whatever you do"
)
CONNECTORS = (
    "and then, then, and, after that, and after that, afterwards, afterward, and afterwards, after which, "
    "next, and next, finally, and finally, lastly, and lastly, "
    "followed by, subsequently, and subsequently, later, and later, thereafter, and also, plus, "
    "before you finish, once that is done, once done, when done, when that is done, "
    "when you are done, once you are done, when you have done that, once you have done that, once finished, "
    "when finished, after this, and once done, and when done, "
    "and once that is done, to finish, and to finish, to end, second, secondly, third, thirdly, now, and now, "
    "as well as, so that you can, "
    "at the end, at the very end, in the end, at last, after you are done, and after this, then next, next up, "
    "and to finish off, to finish off, as a last step, as the last step, as a final step, lastly then, "
    "followed up by, from there, and from there, "
    "after doing that, after doing so, and after doing that, after you have done that, and last, last, "
    "last of all, and last of all, when that is finished, once that is finished, with that done, that done, "
    "having done that, in order to, straight after that, "
    "immediately after that, right after that, once you have it, once you have got it, "
    "once you are holding it, once it is in your gripper, once it is there, when it is there, once there, "
    "when you have it, after it"
)
OPENERS = word_set(", . ; : ! ? and then to you but start try would could can not never first next finally lastly")
"""What a verb may follow where a command begins."""
LATER = (
    "afterwards, afterward, after that, at the end, in the end, once done, when done, once you are done, when you are done, "
    "to finish, to finish off, at the very end"
)
LATER += "".join(
    f", {when} {what} {is_} {there}"
    for when in ("once", "when", "as soon as", "after")
    for what in ("it", "that", "everything")
    for is_ in ("is", "has been", "was", "gets")
    for there in (
        "there", "in place", "done", "finished", "in position", "on it", "in it", "on there", "in there", "inside", "moved",
        "placed", "put down", "set down",
    )
)  # fmt: skip
DOES_TOO = "does, do, does the same, do the same, does likewise, does so, follows, follow"
DOES_TOO += "".join(
    f", {joins} {it}{there}"
    for joins in ("joins", "join", "should join", "can join", "goes with", "accompanies")
    for it in ("it", "them")
    for there in ("", " there", " in there", " inside", " in it", " on it")
)
FIRST = (
    "before you do anything else, before doing anything else, before anything, first things first, "
    "the first thing to do is, as a first thing, start off with, first, firstly, first of all, to begin, "
    "to begin with, to start, to start with, first off, before anything else, initially, first up, at first, "
    "as a first step, step one, for starters, start off, first things first, before all else"
)
FIRST_BUT = (
    "but first, but before that, but before you do that, but before doing that, before that, but first of all, "
    "after first, but beforehand, beforehand, but prior to that, prior to that, but start by, only after, "
    "but only after, only once"
)
FIRST_BUT += "".join(
    f", {but}{before} {that}"
    for but in ("", "and ", "but ")
    for before in ("before", "prior to")
    for that in ("that", "this", "doing that", "doing so", "you do that", "you do so", "you do it", "doing it")
    if f"{but}{before} {that}"
    not in (
        "but before that",
        "but before you do that",
        "but before doing that",
        "before that",
        "but prior to that",
        "prior to that",
    )
)
BEFORE = (
    "before, before you, prior to, but before, and before, before then, but before you, and before you, "
    "ahead of, just before"
)
AFTER = (
    "after, after you, once you have, when you have, after having, as soon as you have, once you, "
    "after you have, and after, and once you have, when you, right after, immediately after, straight after, "
    "having, after you are done, once you are done, when you are done, when done, once done, after finishing, "
    "after you finish, once you finish, as soon as you, upon"
)
TIMES: dict[str, int] = {
    "once": 1,
    "twice": 2,
    "thrice": 3,
    "one time": 1,
    "two times": 2,
    "three times": 3,
    "four times": 4,
    "five times": 5,
    "six times": 6,
    "seven times": 7,
    "eight times": 8,
    "nine times": 9,
    "ten times": 10,
    "a couple of times": 2,
    "a few times": 3,
}
TIMES |= {f"{phrase} each": count for phrase, count in TIMES.items()}
QUESTIONS = word_set(
    """
    what where which who whom whose how when is are was were am does did has had why may might shall
    """
)
CONDITIONS = frozenset(
    {"if", "unless", "whether", "until", "while", "whenever", "every time", "otherwise", "else", "when"}
)
MATERIAL = (
    "with, of, from, out of, using, made of, made up of, consisting of, made from, made out of, by stacking, containing"
)
SWAP_OF = (
    "the positions of, positions of, the places of, places of, the locations of, the position of, "
    "the spots of, the place of, places between, positions between, the order of, locations of, "
    "the location of"
)
LOOK = "if you see, if there is, if you find, if you spot, if you can see, if you can find, if you notice, i see, i can see, i spy, see, you see, do you see, can you see, look at, take a look at, there is, there are, here is, here are, you know"
NOR = "nor, or, and, or is, nor is"
START_FILLERS = "i meant, i meant to say, scratch that, forget that, never mind that, never mind, forget it, change of plan, change of plans, sorry, wait, no wait, oh wait, actually, i mean, oops, and, then, but, no"
CORRECTION = (
    "no, no wait, wait no, wait, wait a second, wait a minute, hang on, hold on, sorry, i mean, i meant, "
    "actually, actually no, no actually, or rather, rather, make that, scratch that, correction, oops, oh no, "
    "no sorry, sorry i mean, sorry i meant, sorry no, not that, not that one, i meant to say, no i mean, "
    "no i meant, no make that, oh wait, oh sorry, wait i mean, wait i meant, oops i mean, oops i meant, "
    "strike that, on second thought, on second thoughts, no wait actually, wait actually, no not that one, "
    "no not that, no hang on, my bad, my mistake, well actually, well no, better, er no, no no, or actually, "
    "oops no, oops sorry, make it, no make it, no make that, or better, better make that, nope, nah, wait sorry, sorry wait, apologies, i misspoke, let us say, or should i say, i should say, no instead"
)
INSTEAD = (
    "instead of, rather than, and not, not, as opposed to, but not, instead of picking up, "
    "rather than picking up, instead of using, in preference to"
)
LIGHT_ADJECTIVES = (
    "gentle, little, small, quick, light, tiny, slight, good, nice, soft, bit of a, careful, firm, hard, big, short"
)
LIGHT_NOUNS = {"push": "push, shove, nudge, prod, bump", "tap": "tap, poke, touch, pat, press", "pick": "lift"}
END_FILLERS = (
    "boss, chief, but do not knock anything over, without knocking anything over, and do not knock anything over, do not knock anything over, without bumping into anything, without hitting anything, without touching anything else, otherwise leave it, otherwise do nothing, or else leave it, otherwise leave it alone, otherwise leave it there, otherwise leave it be, otherwise leave it where it is, otherwise do not do anything, else do nothing, else leave it, either works, either will do, either one works, either is fine, either one is fine, either one will do, but nothing else, and nothing else, nothing else, nothing more, and nothing more, but nothing more, and no others, and only that, and that alone, and that only, that and nothing else, in any order, any order you like, in any order you like, any order, in whatever order, in whatever order you like, the order does not matter, order does not matter, whatever order, in no particular order, no particular order, any old order, the order is up to you, any order will do, any order is fine, or something, or something like that, or whatever, or anything, or what, or so, or somebody, over and out, and leave it open afterwards, and leave it open after that, leave it open afterwards, and leave that open, and do not close it, and do not shut it, actually, if you could, if you can, if you would, if you will, already, for god sake, for me now, "
    "once and for all, would you, will you, could you, can you, would ya, for me please, you know, "
    "and stay there, and stay put, and that is it, "
    "if you would like, ok then, okay then, then please, there is a good lad, though, tho, mind you, love, careful now, careful, steady, steady now, gently now, nice and easy, easy does it, ta, ever so much, me duck, mate, honey, sweetie, sweetheart, darling, buddy, pal, bro, dude, "
    "and leave it open, but leave it open, leave it open, and keep it open, so see to that, so see to it, see to that, see to it, so make it so, make it so, so make it happen, make it happen, so sort that out, you can leave it open, you may leave it open, and you can leave it open, and you may leave it open, but you can leave it open, that is all, ok robot, or so, or thereabouts, it does not matter which, does not matter which, "
    "it does not matter which one, does not matter which one, i do not care which, i do not care which one, "
    "no matter which, any will do, whichever you like, your choice, you choose, you decide"
)
ASIDE_FILLERS = (
    "boss, chief, go on, any one, any two, any three, any four, any of them, any one of them, any two of them, right, so, go, like, fine, there, here, let us see, let me see, let me think, let us think, "
    "you know what, guess what, alright, very good, brilliant, thanks, quick one, listen, listen up, "
    "cheers, wow, hang on, hold on"
)
EDGE_FILLERS = (
    "say, might as well, may as well, you might as well, you may as well, we might as well, all done, done, finished, all finished, yes, sure, of course, awesome, good, great, nice, perfect, cool, excellent, so, well, robot, look, "
    "listen, listen up, now then, right then, here is what i want, here is the plan, here we go, here goes, "
    "my dear, my love, my friend, young man, young lady, young fellow, old chap, my boy, my good man, lad, dear, man, love, honey, sweetie, sweetheart, darling, buddy, pal, bro, dude, sir, fine, see, so then, well then, excuse me, pardon me, attention, as i said, in that case, "
    "panda, franka, robo, hal, robby"
)
GRAMMAR_WORDS = word_set(
    """
    the a an and or of to in on at by from with without then that which is are it them them one ones all both
    every each not no put pick up down left right front back top bottom middle next beside between under over into
    onto off out away corner edge side table robot me my your you number coordinates position x y z cm mm half end
    area region spot place point location part portion colour color coloured but than
    """
)
NEGATIONS = (
    "do not, never, you must not, you should not, must not, should not, i do not want you to, you are not to, no need to, you do not need to, "
    "you do not have to, refrain from, stop, you are not allowed to, you may not, make sure not to, make sure you do not, be careful not to, "
    "try not to, do not even, do not ever, do not you dare, you can not, you shall not, i would rather you did not, i would prefer you did not, "
    "can you not, could you not, would you not, please do not, better not, you better not, under no circumstances, i forbid you to, avoid, without, "
    "and do not, but do not, and never, but never"
)
SAME = (
    "do the same with, do the same for, do the same to, do the same thing with, do the same thing for, the same with, the same for, same for, same with, "
    "do that with, do that for, do likewise with, likewise with, likewise for, repeat with, repeat for, repeat this with, repeat that with, repeat that for, "
    "do it for, do so with, do this with, do it again with, do the same thing to, repeat the same with, repeat the process with, repeat this for"
)
IS_NOW = "is, are, is already, are already, is now, was, were, could be, would be, could go, went, ended up, lands, lies, stands, sat"
STILL = "without moving, without disturbing, without shifting, without displacing, without knocking over, without toppling, without disrupting"
