"""Words about a thing that only its name may tell: stuff, or a state that is a verb as well."""

from __future__ import annotations

from robosandbox.agent.language.wordlist import word_set

SHAPES: dict[str, frozenset[str]] = {
    **dict.fromkeys(("round", "rounded", "circular"), frozenset({"sphere", "cylinder", "capsule", "bowl", "cup"})),
    **dict.fromkeys(("spherical",), frozenset({"sphere"})),
    **dict.fromkeys(("cylindrical", "tubular"), frozenset({"cylinder", "capsule"})),
    **dict.fromkeys(
        ("square", "cubic", "cubical", "boxy", "rectangular", "blocky", "squarish", "cuboid"), frozenset({"box", "bin"})
    ),
}
"""The kinds of objects that have a shape."""

FEELINGS = word_set(
    """
    nice lovely pretty beautiful gorgeous ugly cute adorable silly stupid damn damned bloody blasted bleeding freaking
    flipping darn darned wretched stinking goddamn pesky annoying irritating horrible awful dreadful terrible hideous
    funny cool fancy wonderful marvellous marvelous amazing awesome fantastic fabulous splendid magnificent delightful
    charming precious dear beloved favourite favorite poor boring plain simple ordinary humble trusty good great fine
    excellent perfect handsome elegant interesting curious strange weird odd said aforementioned
    """
) - {"favourite", "favorite", "plain", "simple", "odd", "strange", "good", "great", "fine", "perfect", "said", "trusty"}
"""How the speaker feels about a thing; they tell no two things apart."""
