"""What pages of results say in words."""

import re

from places import ROOT

RESULTS = ROOT / "docs" / "results"


def words(text):
    """Return a text without the parts that commands write, on one line."""
    written = r"<!-- (?P<label>[^>]+) -->.*?<!-- end (?:of )?(?P=label) -->"
    return " ".join(re.sub(written, "", text, flags=re.DOTALL).split())
