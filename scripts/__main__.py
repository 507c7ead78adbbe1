"""The entry of every command: `handrail NAME …`, `handrail-NAME …`, `python -m handrail.scripts NAME …`."""

import os
import sys
from collections.abc import Mapping
from typing import NoReturn

from handrail.controllers.errors import HandrailError, unknown_name
from handrail.scripts import cli
from handrail.scripts.commands import COMMANDS, GROUPS, Command

_HELP = ("-h", "--help", cli.HELP_ALL)


def main() -> NoReturn:
    """Run the command that this program's name or its first word says; list them without one."""
    program, words = os.path.basename(sys.argv[0]), sys.argv[1:]
    prefix, dash, name = program.partition("-")
    if prefix == "handrail" and dash:
        cli.run(lambda: _run(program, name, words))
    cli.run(lambda: _run(f"handrail {words[0]}", *_split(words)) if words else _list_commands())


def _split(words: list[str]) -> tuple[str, list[str]]:
    return words[0], words[1:]


def _run(program: str, name: str, words: list[str]) -> int | None:
    """Run a command with its words; return the exit code."""
    if name in _HELP:
        return _list_commands()
    if name == cli.VERSION:
        return cli.print_version("handrail")
    if name not in COMMANDS:
        raise unknown_name("command", name, COMMANDS)
    command = COMMANDS[name]
    if command.job is not None:
        return command.job.run(cli.parse(command.job.config, program, words))
    return _run_verb(program, command, words)


def _run_verb(program: str, command: Command, words: list[str]) -> int | None:
    """Run one of a command's verbs: the first word, or the second where a folder comes before it."""
    if cli.VERSION in words:
        return cli.print_version(program)
    verb = next((word for word in words[:2] if word in command.verbs), "")
    if verb:
        rest = [word for place, word in enumerate(words) if place != words.index(verb)]
        job = command.verbs[verb]
        return job.run(cli.parse(job.config, f"{program} {verb}", rest))
    if not words or words[0] in _HELP:
        print(f"usage: {program} VERB [OPTIONS]\n\n{command.help}\n")
        _print_lines({verb: job.help for verb, job in command.verbs.items()})
        print(f"\n{program} VERB --help shows the flags.")
        return 0
    raise HandrailError(f"{program} {words[0]}: expected one of {', '.join(command.verbs)} (see --help)")


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
