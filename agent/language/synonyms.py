"""Everyday things that go by several names, British and American, of children and of grown-ups."""

from __future__ import annotations

_GROUPS = """
eraser rubber; saucepan pan pot; frypan pan skillet; flashlight torch; wrench spanner; pen biro; phone mobile cellphone smartphone telephone;
cookie biscuit; candy sweetie; aubergine eggplant; courgette zucchini; glasses spectacles specs; trainer sneaker;
serviette napkin; stone rock pebble; bunny rabbit hare; dog doggy doggie puppy; cat kitty kitten; duck ducky duckie duckling;
teddy bear; bird birdie; horse pony; car auto automobile; truck lorry; plane airplane aeroplane; train locomotive;
doll dolly; bug beetle; cloth rag; pitcher jug; thermos flask; pill tablet; plaster bandaid; vial phial; notebook notepad;
folder binder; scissors shears; sticker label; parcel package packet; bag sack pouch; wallet purse; brooch pin;
prawn shrimp; crisps chips; corn maize; ketchup catsup; mayonnaise mayo; yogurt yoghurt; potato spud; bun roll; burger hamburger;
sausage wiener; wool yarn; thread string twine; glue adhesive; perfume fragrance scent; hat cap; sock stocking;
sweater jumper; shoe boot; towel flannel; sofa couch; photo photograph picture; donut doughnut; faucet spigot; clip clamp; wedge doorstop; envelope letter; remote controller;
microphone mic; ingot bar bullion; amplifier amp; battery batt; thermometer thermo; calculator calc; bicycle bike; hippopotamus hippo; rhinoceros rhino; dictionary dict; binoculars binocs
"""
_PAIRS = [group.split() for group in _GROUPS.replace("\n", " ").split(";")]
SAME_AS: dict[str, frozenset[str]] = {
    word: frozenset(other for group in _PAIRS if word in group for other in group if other != word)
    for group in _PAIRS
    for word in group
}
"""Other words for a thing, by each of its names; singular."""
