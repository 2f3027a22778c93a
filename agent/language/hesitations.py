"""Hesitations: "er" is nothing, or it takes back what was said before it."""

from __future__ import annotations

from collections.abc import Sequence

WAYS = frozenset({"left", "right", "forward", "forwards", "back", "backward", "backwards"})
HESITATIONS = frozenset({"um", "umm", "uh", "uhh", "uhm", "er", "erm", "err", "hmm", "hm", "oh", "ah"})
_DEFINITE = frozenset({"the", "that", "this", "my", "our", "your"})
_PLACING = frozenset(
    {"in", "into", "on", "onto", "to", "next", "beside", "behind", "at", "by", "inside", "between", "under"}
)
_ENDS = frozenset({*",.;!?:", "and", "then"})


def takes_back(before: Sequence[str], after: Sequence[str]) -> bool:
    """Say whether what follows a hesitation is said in the stead of what comes before it.

    As in "left, er, right", "put the purple ball, er, the orange ball in the bowl", "put it in the bowl, uh, the tray"; but "the
    lime in the bowl, um, the fig in the tray" and "the lime, um, the fig and the plum" take nothing back.

    Args:
        before: The words and marks before it.
        after: Those that follow it.
    """
    ways = [text for text in before[-2:] if text != ","], [text for text in after[:2] if text != ","]
    if all(ways) and ways[0][-1] in WAYS and ways[1][0] in WAYS:
        return True
    after = after[1:] if after[:1] == [","] else after
    if before[-1:] != [","] or not after or after[0] not in _DEFINITE:
        return False
    opened = next((k + 1 for k in range(len(before) - 2, -1, -1) if before[k] in _ENDS), 0)
    closed = next((k for k, text in enumerate(after) if text in _ENDS), len(after))
    said, anew = {*before[opened:-1]}, {*after[:closed]}
    listed = opened > 0 or (after[closed : closed + 1] == ["and"] and not anew & _PLACING)
    return bool(said & _DEFINITE) and not listed and not (said & _PLACING and anew & _PLACING)
