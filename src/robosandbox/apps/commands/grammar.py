"""`grammar`: the languages that are data, and the rules and words of one."""

from __future__ import annotations

from typing import Annotated

import typer

from robosandbox.apps.commands.console import print_json
from robosandbox.errors import InputError
from robosandbox.suggestions import did_you_mean


def grammar(
    language: Annotated[str, typer.Argument(help="Whose rules and words to print; without it the languages.")] = "",
    json: Annotated[bool, typer.Option("--json", help="One JSON document.")] = False,
) -> None:
    """List the languages that are pairs of files, or print the rules and words of one; nothing moves."""
    from robosandbox.agent.language.front import learn_words
    from robosandbox.agent.language.ruleset import languages, ruleset
    from robosandbox.skills.catalogue import load_skills

    learn_words(load_skills())
    known = languages()
    if language and language not in known:
        hint = did_you_mean(language, known) or f"; there is {', '.join(known)}"
        raise InputError(f"no language {language[:60]!r}{hint}")
    if language:
        lines = list(ruleset(language).listed())
        if json:
            print_json({"language": language, "lines": lines})
        else:
            print("\n".join(lines))
        return
    books = {name: ruleset(name) for name in known}
    rows = [
        {"language": name, "name": book.vocabulary.name, "rules": len(book.rules), "lines": book.lines}
        for name, book in books.items()
    ]
    if json:
        print_json({"languages": rows})
    for row in rows if not json else ():
        print(f"{row['language']}: {row['name']}, {row['rules']} rules, {row['lines']} lines of data")
