"""The shell commands of README and the pages, in order, and how a test makes them smaller."""

import re
import shlex

from places import ROOT

from handrail.scripts.commands import COMMANDS

_READ_ON = ("recording", "large_datasets", "training", "evaluation", "comparison")
MAIN = ("README.md", *(f"docs/{name}.md" for name in _READ_ON))
_BESIDE = ("cluster", "concepts", "lekiwi", "study", "benchmark", "api")
PAGES = (*MAIN, *(f"docs/{name}.md" for name in _BESIDE))
LESS = {  # flag → the value that it gets where a page gives it
    "handrail-demo": {"--episodes": "1"},
    "handrail-record": {"--dataset.num_episodes": "2"},
    "handrail-train": {"--episodes": "1", "--minutes": "0.1"},
    "handrail-evaluate": {"--episodes": "2", "--workers": "1"},
    "bench operators": {"--episodes": "1"},
    "handrail-study": {"--workers": "2"},
    "bench goal_reaching": {"--goals": "2", "--workers": "1"},
    "bench scaling": {"--episodes": "2"},
    "lerobot-train": {"--steps": "4", "--batch_size": "4", "--num_workers": "0"},
}
MORE = {  # what is added where a page leaves it out
    "handrail-record": {"--dataset.num_episodes": "2"},
    "handrail-train": {"--steps": "4", "--batch_size": "4", "--device": "cpu"},
    "handrail-evaluate": {"--time_limit": "1", "--workers": "1"},
    "bench operators": {"--workers": "1"},
    "bench cases": {"--seconds": "1"},
    "bench speed": {"--updates": "10", "--solves": "1", "--tasks": "reach"},
    "bench rl": {
        "--steps": "60",
        "--random_steps": "20",
        "--save_every": "30",
        "--goals": "1",
        "--final_goals": "1",
        "--layers": "8",
    },
}
SMALL = "policies/study/presets/quick.toml"  # where the test has put a smaller design:
INSTEAD = {"quick": SMALL, "factors": SMALL, "protected": SMALL}
LESS_STUDY = {"rollouts": "2", "persons": "1", "episodes": "2", "minutes": "0.3", "steps": "4"}
NOT_RUN = {
    "make": "sets up and tests this very clone",
    ".": "makes the environment that the test runs in the shell's own",
    "python": "runs the examples, which have a test of their own",
    "pip": "needs the network",
    "apt-get": "needs the network and the administrator",
    "tensorboard": "runs until Ctrl-C",
}
WITH_VERBS = [f"handrail-{name}" for name, command in COMMANDS.items() if command.verbs]
BENCH = ["python", "-m", "handrail.scripts.bench"]
MINUTES = (
    "lerobot-",
    "handrail-study",
    "bench ",
)
MINUTES_TOO = (
    "pick_place",
    "none,mpc",
    "push:2",
    "minute",
    "lerobot_act",
    "diffusion",
    "moving",
    "watched",
    "film",
    "--video",
    "demo",
)


def page_commands(page: str) -> list[list[str]]:
    """Return the words of every command of a page, in order."""
    text = (ROOT / page).read_text()
    blocks = re.findall(r"^```sh\n(.*?)^```", text, flags=re.DOTALL | re.MULTILINE)
    lines = "\n".join(blocks).replace("\\\n", " ").splitlines()
    return [joined(words) for line in lines if (words := shlex.split(line, comments=True))]


def joined(words: list[str]) -> list[str]:
    """Return the words of a command; its verb is of its name, and a bench is `bench NAME`."""
    if words[:3] == BENCH:
        return [f"bench {words[3]}", *words[4:]]
    return [" ".join(words[:2]), *words[2:]] if words and words[0] in WITH_VERBS else words


def small_study() -> str:
    """Return the quick study's design with less of everything."""
    text = (ROOT / "policies" / "study" / "presets" / "quick.toml").read_text()
    for name, value in LESS_STUDY.items():
        text = re.sub(rf"^{name} = .*", f"{name} = {value}", text, flags=re.MULTILINE)
    return text


def takes_minutes(words: list[str]) -> bool:
    """Return whether a command takes long even when it is made small."""
    return words[0].startswith(MINUTES) or any(part in word for word in words for part in MINUTES_TOO)


def made_small(words: list[str]) -> list[str]:
    """Return a command with fewer episodes, steps and the like."""
    name = words[0]
    words = [INSTEAD.get(word, word) for word in words]
    for flag, value in {**MORE.get(name, {}), **LESS.get(name, {})}.items():
        there = [index for index, word in enumerate(words) if word.split("=")[0] == flag]
        if there and "=" in words[there[0]]:
            words = [*words[: there[0]], f"{flag}={value}", *words[there[0] + 1 :]]
        elif there:
            words = [*words[: there[0] + 1], value, *words[there[0] + 2 :]]
        elif flag in MORE.get(name, {}):
            words = [*words, flag, value]
    return words
