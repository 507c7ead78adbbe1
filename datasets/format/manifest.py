"""`meta/handrail.json`: the schema of a dataset, written first and never changed.

`info.json` is replaced after every episode and may be edited or lost; from the manifest it can be rebuilt. A
folder without it was not written by Handrail and is never written to.
"""

import json
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from handrail.controllers.errors import HandrailError
from handrail.datasets.format.info_fields import features
from handrail.datasets.format.layout import Layout
from handrail.datasets.format.schema import OUTCOME_PREFIX, Feature, check_features
from handrail.datasets.storage.strict_json import read_json

FORMAT = 1


@dataclass(frozen=True)
class Manifest:
    """What every episode of a dataset has in common.

    Attributes:
        repo_id: The name, `owner/name`.
        fps: Frames a second [Hz].
        robot_type: The robot.
        features: The columns, without those that LeRobot adds.
        versions: Software versions of the session that created the dataset.
    """

    repo_id: str
    fps: int
    robot_type: str
    features: Mapping[str, Feature]
    versions: Mapping[str, str] = field(default_factory=dict)

    def named(self, repo_id: str) -> "Manifest":
        """Return it with another name."""
        return replace(self, repo_id=repo_id)

    def check(self) -> None:
        """Check everything that can be checked without a disk."""
        if not isinstance(self.repo_id, str) or not self.repo_id or self.repo_id.count("/") > 1:
            raise HandrailError(f"--dataset.repo_id: expected 'owner/name' or 'name', got {self.repo_id!r}")
        if not isinstance(self.fps, int) or isinstance(self.fps, bool) or self.fps < 1:
            raise HandrailError(f"fps: expected a whole number of 1 or more, got {self.fps!r}")
        if not isinstance(self.robot_type, str) or not self.robot_type:
            raise HandrailError(f"robot_type: expected a name, got {self.robot_type!r}")
        check_features(self.features)

    def check_continues(self, existing: "Manifest", root: Path) -> None:
        """Check that episodes of this schema may follow those of an existing dataset."""
        for name in ("fps", "robot_type"):
            if getattr(self, name) != getattr(existing, name):
                raise _differs(root, name, getattr(existing, name), getattr(self, name))
        for key in (*existing.features, *self.features):
            ours, theirs = self.features.get(key), existing.features.get(key)
            if theirs is None and key.startswith(OUTCOME_PREFIX):
                raise HandrailError(
                    f"cannot resume {str(root)!r}: an earlier version recorded it, without {key!r};"
                    " choose another root (the episodes there can still be replayed, trained on and compared)"
                )
            if ours != theirs:
                raise _differs(root, f"feature {key!r}", _describe(theirs), _describe(ours))

    def to_bytes(self) -> bytes:
        """Return the manifest as JSON."""
        features = {key: feature.described for key, feature in self.features.items()}
        content = {"format": FORMAT, "repo_id": self.repo_id, "fps": self.fps, "robot_type": self.robot_type}
        return json_bytes(content | {"versions": dict(self.versions), "features": features})


def read_manifest(layout: Layout) -> Manifest:
    """Read the manifest of a dataset that Handrail wrote."""
    try:
        content = _content(layout)
        fixed = {name: content[name] for name in ("repo_id", "fps", "robot_type")}
        manifest = Manifest(features=features(content), versions=dict(content["versions"]), **fixed)
    except (FileNotFoundError, NotADirectoryError) as error:
        raise HandrailError(_why_no_manifest(layout)) from error
    except (OSError, ValueError, KeyError, TypeError, AttributeError) as error:
        raise HandrailError(
            f"{str(layout.manifest)!r}: expected Handrail's manifest, got {error!r}"
        ) from error
    try:
        manifest.check()
    except HandrailError as error:
        raise HandrailError(f"{str(layout.manifest)!r}: {error}") from error
    return manifest


def json_bytes(content: Any) -> bytes:
    """Return JSON as LeRobot writes it, the same bytes for the same content."""
    return json.dumps(content, indent=4, ensure_ascii=False, allow_nan=False).encode()


def _content(layout: Layout) -> dict[str, Any]:
    """Return what the manifest says, its format checked first: a newer one may say anything else."""
    content = read_json(layout.manifest)
    if content["format"] != FORMAT:
        raise HandrailError(
            f"dataset {str(layout.root)!r}: expected format {FORMAT}, got {str(content['format'])[:60]};"
            " a newer Handrail wrote it"
        )
    return content


def _why_no_manifest(layout: Layout) -> str:
    root = str(layout.root)
    if not layout.root.is_dir():
        return f"dataset {root!r}: expected a folder, found none; create it first, or check the path"
    if layout.info.exists():
        return f"dataset {root!r} was not written by Handrail (no meta/handrail.json): choose another folder"
    return f"{root!r} is not a LeRobot dataset (no meta/info.json): choose another folder"


def _describe(feature: Feature | None) -> str:
    if feature is None:
        return "none"
    names = f" ({', '.join(feature.names)})" if feature.names and not feature.is_video else ""
    return f"{feature.dtype} {feature.shape}{names}"


def _differs(root: Path, thing: str, existing: object, given: object) -> HandrailError:
    return HandrailError(
        f"--resume: cannot add to {str(root)!r}: {thing} of the existing episodes is {existing}, got {given};"
        " give the same, or choose another folder"
    )
