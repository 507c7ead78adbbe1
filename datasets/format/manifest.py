"""`meta/handrail.json`: the schema of a dataset, written first and never changed.

`info.json` is replaced after every episode and may be edited or lost; from the manifest it can be rebuilt. A
folder without it was not written by Handrail and is never written to.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Annotated, Any

import msgspec
from msgspec import Meta

from handrail.controllers.errors import HandrailError
from handrail.controllers.typed import check_settings
from handrail.datasets.format.layout import Layout
from handrail.datasets.format.schema import Feature, check_features, features_of
from handrail.datasets.storage.strict_json import json_bytes, read_json

FORMAT = 1


class _ManifestFile(msgspec.Struct):
    """`handrail.json` as it is stored."""

    repo_id: str
    fps: int
    robot_type: str
    features: dict[str, dict[str, Any]]
    versions: dict[str, Any]


@dataclass(frozen=True)
class Manifest:
    """The properties that every episode of a dataset shares."""

    repo_id: str
    """The name, `owner/name`."""
    fps: Annotated[int, Meta(ge=1)]
    """Frames a second [Hz]."""
    robot_type: Annotated[str, Meta(min_length=1)]
    features: Mapping[str, Feature]
    """The columns, without those that LeRobot adds."""
    versions: Mapping[str, str] = field(default_factory=dict)
    """Software versions of the session that created the dataset."""

    def check(self) -> None:
        """Check everything that can be checked without a disk."""
        if not isinstance(self.repo_id, str) or not self.repo_id or self.repo_id.count("/") > 1:
            raise HandrailError(f"--dataset.repo_id: expected 'owner/name' or 'name', got {self.repo_id!r}")
        check_settings(self)
        check_features(self.features)

    def check_fits(self, other: "Manifest", refused: str) -> None:
        """Check that episodes of this schema may follow those of another; `refused` begins the error."""
        things = {name: (getattr(other, name), getattr(self, name)) for name in ("fps", "robot_type")}
        for key in (*other.features, *self.features):
            things[f"feature {key!r}"] = _describe(other.features.get(key)), _describe(self.features.get(key))
        for thing, (theirs, ours) in things.items():
            if theirs != ours:
                raise HandrailError(f"{refused}: {thing} of the existing episodes is {theirs}, got {ours}")

    def to_bytes(self) -> bytes:
        """Return the manifest as JSON."""
        features = {key: feature.described for key, feature in self.features.items()}
        content = {"format": FORMAT, "repo_id": self.repo_id, "fps": self.fps, "robot_type": self.robot_type}
        return json_bytes(content | {"versions": dict(self.versions), "features": features})


def read_manifest(layout: Layout) -> Manifest:
    """Read the manifest of a dataset that Handrail wrote."""
    root = str(layout.root)
    try:
        content = read_json(layout.manifest)
        if content["format"] != FORMAT:  # first of all: a newer one may say anything else
            raise HandrailError(
                f"expected format {FORMAT}, got {str(content['format'])[:60]}; a newer Handrail wrote it"
            )
        said = msgspec.convert(content, _ManifestFile)
        found = Manifest(said.repo_id, said.fps, said.robot_type, features_of(said.features), said.versions)
        found.check()
        return found
    except (FileNotFoundError, NotADirectoryError) as error:
        got = "a folder without one" if layout.root.is_dir() else "no folder"
        if layout.info.exists():
            got = "one that was not written by Handrail (no meta/handrail.json)"
        raise HandrailError(
            f"{root!r}: expected a LeRobot dataset, got {got}; choose another folder, or check the path"
        ) from error
    except HandrailError as error:
        raise HandrailError(f"{str(layout.manifest)!r}: {error}") from error
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise HandrailError(
            f"{str(layout.manifest)!r}: expected Handrail's manifest, got {error!r}"
        ) from error


def _describe(feature: Feature | None) -> str:
    if feature is None:
        return "none"
    names = f" ({', '.join(feature.names)})" if feature.names and not feature.is_video else ""
    return f"{feature.dtype} {feature.shape}{names}"
