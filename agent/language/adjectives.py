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

TINTS = word_set(
    """
    sunny canary sky sea forest blood neon vivid electric royal baby hot bubblegum snow jet coal grass army hunter ocean
    brick rust pastel fluorescent bold vibrant brilliant pure solid leaf moss midnight powder steel ruby fire flame
    sunshine banana cherry tomato apple
    """
)
"""What says more closely which colour: "sky blue"."""

CLAIMS = word_set(
    """
    metal metallic wooden wood plastic rubber rubbery ceramic porcelain paper cardboard woollen cotton iron edible eatable
    fluffy soft hard squishy sharp pointy clean dry warm cool hot poison spare needed
    """
)
"""What is said of a thing and only its name may tell: stuff, or a state that is a verb as well."""

DISTINCT = frozenset({"different", "separate", "distinct", "individual"})
"""As in "in different bins": each thing has one of its own."""

MEASURES = word_set(
    """
    roll packet bar stick piece bit jar tube bunch bag loaf carton slice sheet lump chunk pack sachet pair tub box bottle can
    tin cup glass mug pot reel spool ball block kind sort type
    """
)
"""As in "a roll of tape": what stands before "of" and adds nothing where the name alone is known."""
