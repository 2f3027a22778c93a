"""The words that the ids of a scene add to a language."""

from __future__ import annotations

import re
from dataclasses import dataclass
from functools import cached_property, lru_cache

from robosandbox.agent.language.things import COLOURS, NOUNS, POSITIONS, SHADES, SIZES
from robosandbox.agent.language.wordlist import phrase_list, word_set

_GRAMMAR_WORDS = word_set(
    """
    the a an and or of to in on at by from with without then that which is are it them them one ones all both
    every each not no put pick up down left right front back top bottom middle next beside between under over into
    onto off out away corner edge side table robot me my your you number coordinates position x y z cm mm half end
    area region spot place point location part portion colour color coloured but than
    """
)
_MOST = word_set(
    """
    leftmost rightmost nearest closest frontmost farthest furthest rearmost backmost biggest largest bigger larger smallest littlest
    tiniest smaller tallest taller longest longer shortest shorter flattest widest wider broadest thickest thicker narrowest narrower
    thinnest thinner topmost top uppermost highest upper bottommost bottom lowest lower
    """
)
_DESCRIBING = _MOST.union(
    word
    for table in (COLOURS, SHADES, SIZES, POSITIONS)
    for phrases in table.values()
    for phrase in phrase_list(phrases)
    for word in phrase.split()
)
_TELLING = _DESCRIBING | _GRAMMAR_WORDS
_NOUN_WORDS = frozenset(word for phrases in NOUNS.values() for word in phrase_list(phrases))
_COLOUR_WORDS = frozenset(word for phrases in COLOURS.values() for word in phrase_list(phrases))
_HUES = _COLOUR_WORDS - {*COLOURS, "gray"}
_IN_NAMES = frozenset({"in", "out", "on", "off"})
_TABLES = word_set("table tabletop desk desktop surface counter countertop workbench bench worktop workspace")


@dataclass(frozen=True, eq=False)
class SceneWords:
    """The words of one scene's ids.

    Attributes:
        ids: Ids by their lower-case form.
        parts: Words that occur in ids.
        pattern: Finds ids in text.
        spoken: Ids of several words that end in a number or letter, or begin like the table does ("desk drawer"), or of two words that describe nothing ("fruit basket"), as words.
    """

    ids: dict[str, str]
    parts: frozenset[str]
    pattern: re.Pattern[str] | None
    spoken: tuple[tuple[tuple[str, ...], str], ...] = ()

    @cached_property
    def hues(self) -> frozenset[str]:
        """The colours that a thing is called after and nothing else: "orange" where there is an orange."""
        names = [[part for part in id_parts(name) if part.isalpha() and len(part) > 1] for name in self.ids]
        return frozenset(name[0] for name in names if len(name) == 1 and name[0] in COLOURS)

    @cached_property
    def by_first_word(self) -> dict[str, list[tuple[tuple[str, ...], str]]]:
        """`spoken` by the first word."""
        table: dict[str, list[tuple[tuple[str, ...], str]]] = {}
        for parts, name in self.spoken:
            table.setdefault(parts[0], []).append((parts, name))
        return table

    @cached_property
    def stems(self) -> dict[str, list[tuple[tuple[str, ...], tuple[str, ...]]]]:
        """Names in full without their number, as they are said, with the words of the id, by the first word.

        Those of which a word describes and another says nothing, as "akita black bowl", and those of two colours, as "yellow and
        white mug": other readings take their words apart.
        """
        table: dict[str, list[tuple[tuple[str, ...], tuple[str, ...]]]] = {}
        for stem in dict.fromkeys(id_parts(name)[:-1] for name in self.ids if name[-1].isdigit()):
            told = [part in _TELLING or part in _NOUN_WORDS for part in stem]
            # "wine bottle" names by two nouns; the words of "red cube" describe.
            named = len(stem) > 1 and _DESCRIBING.isdisjoint(stem)
            ways: list[tuple[str, ...]] = [stem] if named or (any(told) and not all(told)) else []
            colours = tuple(part for part in stem if part in _COLOUR_WORDS)
            if len(colours) == 2 and stem[:2] in (colours, colours[::-1]):
                ways += [
                    (one, *joint, other, *stem[2:])
                    for one, other in (colours, colours[::-1])
                    for joint in ((), ("and",))
                ]
            for way in ways:
                table.setdefault(way[0], []).append((way, stem))
            called: tuple[str, ...] = tuple(part for part in stem if part not in _DESCRIBING)
            if 1 < len(called) < len(stem):
                # "the tomato sauce" for white_tomato_sauce_1
                table.setdefault(called[0], []).append((called, called))
        return table


@lru_cache(maxsize=256)
def scene_words(ids: tuple[str, ...]) -> SceneWords:
    """Return the vocabulary that a scene's ids add."""
    parts = {part for name in ids for part in id_parts(name)}
    spelled = sorted((re.escape(name) for name in ids if len(id_parts(name)) > 1), key=len, reverse=True)
    pattern = re.compile(rf"(?<![\w.-])(?:{'|'.join(spelled)})(?![\w-])", re.IGNORECASE) if spelled else None
    spoken = tuple(
        (id_parts(name), name)
        for name in ids
        if len(id_parts(name)) > 2
        or (len(id_parts(name)) == 2 and (name[-1].isdigit() or len(id_parts(name)[-1]) == 1))
        or (len(id_parts(name)) == 2 and id_parts(name)[0] in _TABLES)
        # A "salmon roll" is called so, whatever its colour.
        or (len(id_parts(name)) == 2 and id_parts(name)[0] in _HUES)
        # "in tray" is a name and no place.
        or (len(id_parts(name)) == 2 and id_parts(name)[0] in _IN_NAMES)
        # "fruit basket" means the one called so, "block red" likewise; "red cube" describes.
        or (len(id_parts(name)) == 2 and not {*id_parts(name)} & _TELLING)
        or (len(id_parts(name)) == 2 and id_parts(name)[-1] in _COLOUR_WORDS)
    )
    return SceneWords({name.lower(): name for name in ids}, frozenset(parts), pattern, spoken)


@lru_cache(maxsize=1024)
def id_parts(name: str) -> tuple[str, ...]:
    """Return the words of an id: "blue_block2" -> blue, block, 2."""
    spaced = re.sub(r"(?<=[a-z])(?=[A-Z])", " ", name)
    return tuple(re.findall(r"[a-z]+|\d+", spaced.lower()))
