"""README, the pages and their shell commands; the configuration of every command by its name."""

import re
import shlex
from collections.abc import Iterable

from places import ROOT

from handrail.scripts.bench.__main__ import BENCHES
from handrail.scripts.commands import COMMANDS

VERBS = {
    f"handrail-{name} {verb}".strip(): each
    for name, command in COMMANDS.items()
    for verb, each in command.verbs.items()
}
BENCH_CONFIGS = {f"bench {name}": bench.config for name, bench in BENCHES.items()}
COMMAND_CONFIGS = {name: verb.config for name, verb in VERBS.items()}
CONFIGS = COMMAND_CONFIGS | BENCH_CONFIGS

PAGES = ("README.md", *sorted(str(path.relative_to(ROOT)) for path in (ROOT / "docs").glob("*.md")))
RESULTS = sorted(str(path.relative_to(ROOT)) for path in (ROOT / "docs" / "results").glob("*.md"))
DOCUMENTS = (*PAGES, "CONTRIBUTING.md", "CHANGELOG.md", "SECURITY.md", *RESULTS)
BENCH = ["python", "-m", "handrail.scripts.bench"]


def text(page: str) -> str:
    return (ROOT / page).read_text()


def commands(prefix: str = "", pages: Iterable[str] = DOCUMENTS, kinds: str = "sh|bash|console"):
    """Return the words of every command in the shell blocks of some pages, in order.

    A command's verb is of its name, and a bench is `bench NAME`.
    """
    found = []
    for page in pages:
        blocks = re.findall(rf"^```(?:{kinds})\n(.*?)^```", text(page), re.DOTALL | re.MULTILINE)
        for line in "\n".join(blocks).replace("\\\n", " ").splitlines():
            words = shlex.split(line, comments=True)
            if words[:3] == BENCH:
                words = [f"bench {words[3]}", *words[4:]]
            elif " ".join(words[:2]) in CONFIGS:
                words = [" ".join(words[:2]), *words[2:]]
            found += [words] if words and words[0].startswith(prefix) else []
    return found
