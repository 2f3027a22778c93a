"""Orders as they stand in work instructions, test plans and logs, each with the plainer words for it (see `template`)."""

from __future__ import annotations

# fmt: off
_SEP = "(,|;|/|.|and|then|, then|, and|and then)"
_GRASP = "(grasp|grab|grip|clamp|take|close [gripper])"
_LIFT = "(lift|raise|pick) [it|up] [up]"
_KEPT = "(unchanged|constant|fixed|the same|as is|same|const|untouched)"
TERSE = {
    # What is to be carried out, in as few words as will do.
    "<verb> (execute|run|perform|invoke|initiate) {VERB}": "{VERB}",
    "<verb> (execute|run|perform|initiate) [a|the] {LIGHT_NOUN} (of|on|to) {thing}": "{LIGHT_NOUN} {thing}",
    "<verb> (execute|run|perform|initiate|do|start) [a|the] (home|homing) [sequence|routine|move|motion|command|cycle|run] <edge>": "go home",
    "<edge> (homing|home arm|home robot|home the (arm|robot)|rth|return to home|arm home|robot home|go to home) <edge>": "go home",
    "<start> (requirement|req|spec|goal|target|goal state|target state|desired state|end state|the end state|final! state|task|job|objective|to do|todo|request|order|action|demand) [is] : {thing} {place}": "put {thing} {place}",
    "<start> (requirement|req|spec|goal|target|task|job|objective|to do|todo|request|order|action|demand|test|command|cmd) [is] : {VERB}": "{VERB}",
    "<edge> it is (requested|required|desired|expected|specified|intended|planned|mandatory|demanded|proposed|recommended|asked) that {thing} [should|shall|must] (be|is|are|get|gets|has been) [placed|put|moved|transferred|stored|deposited|located|positioned|brought|carried|set|stacked|inserted|dropped] {place}": "put {thing} {place}",
    "<edge> it is (requested|required|desired|expected|specified|intended|planned|mandatory|demanded|proposed|recommended|asked) that {thing} [should|shall|must] be (picked up|lifted|grasped|picked|raised|grabbed)": "pick up {thing}",
    "<edge> it is (requested|required|desired|expected|specified|intended|planned|mandatory|demanded|proposed|recommended|asked) that {thing} [should|shall|must] be (tapped|touched|pressed)": "tap {thing}",
    "<edge> it is (requested|required|desired|expected|specified|intended|planned|mandatory|demanded|proposed|recommended|asked) that {thing} [should|shall|must] be opened": "open {thing}",
    "<edge> it is (requested|required|desired|expected|specified|intended|planned|mandatory|demanded|proposed|recommended|asked) that {thing} [should|shall|must] be (closed|shut)": "close {thing}",
    # Both ends of a transfer, with or without the grasp between them.
    f"<start> [move|send|bring] [the] (gripper|tcp|hand|end effector|arm|robot) [move|moves|go|goes] (to|at|over|above|towards) {{one}} {_SEP} {_GRASP} [it] [{_SEP} {_LIFT}] [{_SEP} hold [it] [there|up]] <edge>": "pick up {one}",
    f"<verb> (approach|go to|move to|reach|locate|find) {{one}} {_SEP} {_GRASP} [it] [{_SEP} {_LIFT}] [{_SEP} hold [it] [there|up]] <edge>": "pick up {one}",
    f"<verb> (grasp|grip|grab) {{one}} {_SEP} {_LIFT} [{_SEP} hold [it] [there|up]] <edge>": "pick up {one}",
    "<verb> (pick|pick up|grab|grasp|take) {one} [,|;|/|and|then|and then] (place|put|drop|insert|deposit|release) [to] {container} <edge>": "put {one} in {container}",
    "<verb> (pick|pick up|grab|grasp|grip|lift) {thing} to {container} <edge>": "put {thing} in {container}",
    "<verb> (mv|xfer|trf|tfr) {thing} [to|,|into|in] {container} <edge>": "put {thing} in {container}",
    "<verb> (mv|xfer|trf|tfr) {thing} {place} <edge>": "put {thing} {place}",
    "<verb> (mv|xfer|trf|tfr) {thing} {way}": "push {thing} {way}",
    "<edge> {one} (source|src|from) : {_place} [,|;] (destination|dest|target|to) : {place} <edge>": "put {one} {place}",
    "<edge> (object|part|item|workpiece|load) : {one} [,|;|.] (destination|dest|target|goal|place|location|to) : {container} <edge>": "put {one} in {container}",
    "<edge> {thing} (to|in|into) {drawer} [,|:] open (/|,|;|and|then|to|+) (insert|place|put in|put|load|drop|place in) [it] (/|,|;|and|then|to|+) [then] (close|shut)": "open {drawer} , put {thing} in it , close it",
    "/ {VERB} {thing}": ", {VERB} {thing}",
    # How far, which way, and what stays as it is.
    "away from [the|your|its] [robot|arm] (base|origin) {edge:,|.|;|and|then|by}": "away from you {edge}",
    "away from [the|your|its] [robot|arm] (base|origin) <end>": "away from you",
    "(toward|towards) [the|your|its] [robot|arm] (base|origin) {edge:,|.|;|and|then|by}": "towards you {edge}",
    "(toward|towards) [the|your|its] [robot|arm] (base|origin) <end>": "towards you",
    "(laterally|horizontally|linearly) {way}": "{way}",
    "{way} (laterally|horizontally|linearly) <edge>": "{way}",
    "<verb> (offset|jog|index|advance) {thing} {way}": "push {thing} {way}",
    "<verb> (offset|jog|index|advance) {thing} by {distance}": "push {thing} {distance}",
    "{away:away from you|towards you|forward|forwards|backward|backwards|back} [by] {distance} [,|and|;] [keep|keeping|with|holding] y [coordinate|position|value|axis] [stays|is|kept|held|remains] " + _KEPT: "{away} {distance}",
    "{distance} {away:away from you|towards you|forward|forwards|backward|backwards|back} [,|and|;] [keep|keeping|with|holding] y [coordinate|position|value|axis] [stays|is|kept|held|remains] " + _KEPT: "{distance} {away}",
    "<edge> {thing} (:|,) {way} {way2} (:|,) (push|pushed|by pushing|slide) [(,|:) no! (grasp|grasping|grip|gripping|pick|picking|lift|lifting)] <edge>": "push {thing} {way} {way2}",
    "<verb> {_VERB=push} {thing} {way} {way2} (,|and|but) (no!|do not!|without!) (grasp|grasping|grip|gripping|pick|picking|lift|lifting) [it] <edge>": "push {thing} {way} {way2}",
    "<verb> {_VERB=push} {thing} {way} (,|and|but) (no!|do not!|without!) (grasp|grasping|grip|gripping|pick|picking|lift|lifting) [it] <edge>": "push {thing} {way}",
    # How often, in which order, how high.
    "<verb> {n:two|three|four|2.0|3.0|4.0} (taps|touches) (on|to|at|for|of) {thing}": "tap {thing} {n} times",
    "<verb> (give|apply|do) [to] {thing} {n:two|three|four|2.0|3.0|4.0} (taps|touches)": "tap {thing} {n} times",
    "<verb> {n:twice|thrice} {VERB=tap} {thing}": "{VERB=tap} {thing} {n}",
    "<verb> {n:two|three|four|2.0|3.0|4.0} (x|times) {VERB=tap} {thing}": "{VERB=tap} {thing} {n} times",
    "<verb> double {VERB=tap} {thing}": "{VERB=tap} {thing} twice",
    "<verb> triple {VERB=tap} {thing}": "{VERB=tap} {thing} three times",
    "<start> {_VERB=tap} (test|order|sequence|check|list|all of these|the following|these) [,] [in [the|this] [following|given|listed] (order|sequence)] (:|,) {thing}": "tap {thing}",
    "<start> {_VERB=tap} [,] [in [the|this] [following|given|listed] (order|sequence)] : {thing}": "tap {thing}",
    "<start> (order of (touch|touching|tapping)|(touching|tapping) (order|sequence)) [is] (:|,) {thing}": "tap {thing}",
    "(listed|given|named|written|stated|ordered) [from] {from:bottom|top} to {to:bottom|top}": "from {from} to {to}",
    "from the (ground|floor|base|table|foundation|ground level) up": "from bottom to top",
    "(by size|in order of size|sorted by size|ordered by size|size ordered) [,|:|;] [with] [the] (largest|biggest|widest) [one] (at|on|is) [the] (bottom|base)": "with the biggest at the bottom",
    "(by size|in order of size|sorted by size|ordered by size|size ordered) [,|:|;] [with] [the] smallest [one] (at|on|is) [the] top": "with the biggest at the bottom",
    "<start> [a|one] 3! (high|level|tier|storey|story|layer|block|cube) (stack|tower|pile) (on|on top of) {one} (,|:) [from] (bottom to top|bottom up) [:|,] {one2} , {one3} (, and|,|and) {one4} <end>": "put {one2} on {one} , then put {one3} on {one2} , then put {one4} on {one3}",
    "<start> [a|one] 2! (high|level|tier|storey|story|layer|block|cube) (stack|tower|pile) (on|on top of) {one} (,|:) [from] (bottom to top|bottom up) [:|,] {one2} (, and|,|and) {one3} <end>": "put {one2} on {one} , then put {one3} on {one2}",
    "<start> [a|one] 3! (high|level|tier|storey|story|layer|block|cube) (stack|tower|pile) (,|:) [from] (bottom to top|bottom up) [:|,] {one2} , {one3} (, and|,|and) {one4} <end>": "put {one3} on {one2} , then put {one4} on {one3}",
    "<start> [make|build] (2!|two!) (towers|stacks|piles) (:|,) {one} on {one2} (,|;|and|, and) {one3} on {one4} <end>": "put {one} on {one2} . put {one3} on {one4}",
    "<start> {one} first! , {one2} second! (,|;) (both|all) {place} <end>": "put {one} {place} , then put {one2} {place}",
    # Which one it is, by what can be measured.
    "(with|having|of|at) [the] (smallest|shortest|least|minimal|minimum|lowest|min) distance (to|from) {one}": "closest to {one}",
    "(with|having|of|at) [the] (largest|greatest|longest|maximal|maximum|highest|biggest|max) distance (to|from) {one}": "farthest from {one}",
    "(with|having|at) [the] (largest|greatest|maximal|maximum|highest|biggest|max) x [coordinate|value|position]": "farthest from you",
    "(with|having|at) [the] (smallest|least|minimal|minimum|lowest|min) x [coordinate|value|position]": "closest to you",
    "(with|having|at) [the] (largest|greatest|maximal|maximum|highest|biggest|max) y [coordinate|value|position]": "farthest to the left",
    "(with|having|at) [the] (smallest|least|minimal|minimum|lowest|min) y [coordinate|value|position]": "farthest to the right",
    "(with|having|of) [the] (largest|greatest|maximal|maximum|highest|biggest|max) height": "that is tallest",
    "(with|having|of) [the] (smallest|least|minimal|minimum|lowest|min) height": "that is shortest",
}
"""Notation that stands in sentences; what stands in single words and numbers is in `notation`."""
