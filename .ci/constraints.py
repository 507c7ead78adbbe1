"""Writes constraints.txt: the versions installed in this environment of everything that Handrail needs.

Names and versions only, never an address: where they come from is the reader's own configuration.
Run by `make constraints` after an upgrade.
"""

import tomllib
from importlib import metadata
from pathlib import Path

from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

ROOT = Path(__file__).parent.parent
HEADER = "# Versions that Handrail was tested with; written by `make constraints`, do not edit.\n"


def roots() -> list[Requirement]:
    """Return what pyproject.toml asks for, all extras and the build's needs included."""
    data = tomllib.loads((ROOT / "pyproject.toml").read_text())
    extras = data["project"]["optional-dependencies"].values()
    texts = data["project"]["dependencies"] + data["build-system"]["requires"]
    texts += [text for extra in extras for text in extra]
    return [Requirement(text) for text in texts]


def closure(requirements: list[Requirement]) -> dict[str, str]:
    """Return the installed version of every distribution that the requirements lead to."""
    versions: dict[str, str] = {}
    seen: set[tuple[str, str]] = set()
    waiting = [(needed.name, extra) for needed in requirements for extra in ("", *needed.extras)]
    while waiting:
        name, extra = waiting.pop()
        name = canonicalize_name(name)
        if (name, extra) in seen:
            continue
        seen.add((name, extra))
        distribution = metadata.distribution(name)
        versions[name] = distribution.version.split("+")[0]  # a build such as +cpu is the reader's choice
        for text in distribution.requires or []:
            needed = Requirement(text)
            if needed.marker is None or needed.marker.evaluate({"extra": extra}):
                waiting += [(needed.name, more) for more in ("", *needed.extras)]
    return versions


if __name__ == "__main__":
    pins = closure(roots())
    lines = [f"{name}=={version}\n" for name, version in sorted(pins.items())]
    (ROOT / "constraints.txt").write_text(HEADER + "".join(lines))
    print(f"constraints.txt: {len(lines)} versions")
