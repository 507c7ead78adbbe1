"""Pictures of the page for people to look at, in the folder that `HANDRAIL_SHOTS` names, if it does."""

import os
from pathlib import Path

FOLDER = os.environ.get("HANDRAIL_SHOTS", "")


def shoot(page, name):
    """Keep a picture of the page, if somebody wants them."""
    if FOLDER:
        Path(FOLDER).mkdir(parents=True, exist_ok=True)
        page.screenshot(path=Path(FOLDER) / f"{name}.png")
