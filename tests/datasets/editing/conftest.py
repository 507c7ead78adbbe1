"""A dataset of three episodes, and a hub that takes it."""

import pytest
from canned import copied
from editing_helpers import record_episodes
from hub_helpers import Hub


@pytest.fixture
def hub(monkeypatch):
    hub = Hub()
    monkeypatch.setattr("lerobot.datasets.lerobot_dataset.HfApi", hub)
    monkeypatch.setattr("handrail.datasets.editing.push.HfApi", hub)
    monkeypatch.setattr(
        "huggingface_hub.DatasetCard.push_to_hub", lambda card, **said: hub.push_card(card, **said)
    )
    return hub


@pytest.fixture
def root(tmp_path):
    return copied(tmp_path / "set", record_episodes, 3, cameras=True, mode="ee")
