"""The entry of every command: `handrail NAME …`, `handrail-NAME …`, `python -m handrail.scripts NAME …`."""

import os
import sys
from collections.abc import Mapping
from typing import NoReturn

from handrail.controllers.errors import HandrailError, check_known
from handrail.scripts import cli
from handrail.scripts.commands import COMMANDS, GROUPS

_HELP = ("-h", "--help", cli.HELP_ALL)


def main() -> NoReturn:
    """Run the command that this program's name or its first word says; list them without one."""
    program, words = os.path.basename(sys.argv[0]), sys.argv[1:]
    prefix, dash, name = program.partition("-")
    if prefix == "handrail" and dash:
        cli.run(lambda: _run(program, name, words))
    cli.run(lambda: _run(f"handrail {words[0]}", words[0], words[1:]) if words else _list_commands())


def _run(program: str, name: str, words: list[str]) -> int | None:
    """Run a command with its words; return the exit code."""
    if name in _HELP:
        return _list_commands()
    if name == cli.VERSION:
        return cli.print_version("handrail")
    check_known("command", (name,), COMMANDS)
    verbs = COMMANDS[name].verbs
    if "" in verbs:
        return verbs[""].run(cli.parse(verbs[""].config, program, words))
    if cli.VERSION in words:
        return cli.print_version(program)
    # the verb is the first word, or the second where a folder comes before it
    if verb := next((word for word in words[:2] if word in verbs), ""):
        rest = [word for place, word in enumerate(words) if place != words.index(verb)]
        return verbs[verb].run(cli.parse(verbs[verb].config, f"{program} {verb}", rest))
    if words and words[0] not in _HELP:
        raise HandrailError(f"{program} {words[0]}: expected one of {', '.join(verbs)} (see --help)")
    print(f"usage: {program} VERB [OPTIONS]\n\n{COMMANDS[name].help}\n")
    _print_lines({verb: each.help for verb, each in verbs.items()})
    print(f"\n{program} VERB --help shows the flags.")
    return 0


def _list_commands() -> int:
    print("usage: handrail NAME [OPTIONS], or handrail-NAME [OPTIONS]")
    for group, commands in GROUPS.items():
        print(f"\n{group}")
        _print_lines({name: command.help for name, command in commands.items()})
    print("\nhandrail NAME --help shows the flags.")
    return 0


def _print_lines(lines: Mapping[str, str]) -> None:
    for name, help in lines.items():
        print(f"  {name:10}  {help}")


if __name__ == "__main__":
    main()
