"""Words that tell an aside from an order: who is spoken of, how a clause goes on, what may bind an order."""

from __future__ import annotations

from robosandbox.agent.language.slots import PEOPLE
from robosandbox.agent.language.wordlist import word_set

BINDING = word_set(
    """
    if unless until till whether otherwise else instead except only again maybe perhaps nor neither without
    cancel abort joking kidding joke wrong mistake mistaken meant mean or mind changed
    pretend pretending hypothetically fictional imaginary
    nobody nothing none careful avoid beware allowed forbidden upright upside sideways rather twice
    """
)
"""What may forbid, limit, put off or take back an order, wherever it stands."""
PUT_OFF = word_set("stop wait forget already done finished enough later tomorrow tonight not never no")
"""What may do so but where it is told of somebody: "I can not see", "she comes later"."""
HELD_BACK = word_set(
    "yet now ready sure want wants mean think like ask say said tell told so longer done finished it that this them those one ones "
    "myself ourselves himself herself please way allowed need needs"
)
"""With which a "not" of somebody's may be about the order: "I do not think so", "I am not ready yet"."""
TIMED = word_set("when whenever once after then first last next")
"""How clauses begin that say when."""
JOINTS = word_set("and but so because cause since before while as though although which who")
LEADS = word_set(
    "and but so because cause since before while as though although well oh also anyway now ok okay that hey yeah yes right just yesterday today"
)
REASONS = word_set("because cause since as so though although")
PERSONS = (
    word_set(
        "i we he she you everyone everybody someone somebody people mommy nobody mom mum dad guests visitors customers boss"
    )
    | PEOPLE
)
WHOSE = word_set("my our his her their your")
DETERMINERS = WHOSE | word_set("the a an some that this these those one")
REFERRING = word_set("it this that they there these those things")
OBJECTS = word_set("it them that this those these one ones")
AUXILIARIES = word_set(
    "is are was were am has have had will would can could does did do may might shall should must be been"
)
FINITE = AUXILIARIES | word_set(
    """
    came went got made took told thinks loves hates knows fell broke ran kept found lost spent heard built bought thought
    felt says say needs wants looks seems feels smells sounds gets goes keeps makes takes comes hurts hurt gave saw knew
    grew woke forgot hit cost won sang wrote burnt
    """
)
ASKING = word_set(
    "want wants need needs wish wishes like likes prefer prefers love expect wanted needed asked asks say says said tell told"
)
MODALS = word_set("should must may can could shall might ought would")
PLACING = word_set("goes gets needs wants keeps takes comes")
BEING = word_set("is are was were be been looks look getting so very too")
ADDRESSING = word_set("look see listen hear guess imagine think feel have be help thank bless believe trust know say")
"""Verbs with which a speaker turns to somebody: no order while no thing is named."""
GREETINGS = word_set("sorry thanks thank cheers hello hi welcome congratulations apologies excuse pardon bravo")
WILLING = word_set(
    "mind kind good nice able possible convenient minute moment second time chance ready ok okay alright right fine trouble"
)
POLITE = WILLING | word_set(
    "if when whenever you it that is would be are were can could so sweet lovely not too much of to a an the for up all me have "
    "get got find please no bother problem at as do with"
)
LABELS = word_set("task job thing deal plan request mission order command goal instruction")
ORDERED = frozenset({"ORDINAL", "FIRST", "THEN", "SUPER"})
NO_MATTER = word_set("rush hurry pressure worries worry problem stress trouble fuss")
