"""One value for a table: a terminal, a report and a Markdown page show the same cells."""

import html
import io

import pytest
from rich.console import Console

from handrail.controllers.errors import HandrailError
from handrail.datasets.presentation.markdown import markdown_table, with_part
from handrail.datasets.presentation.markup import page, section
from handrail.datasets.presentation.table import Cell, Table

TABLE = Table(
    ("who", "how much [m]"),
    [["a|b", Cell("1.0", "quiet", "why", "0.5 … 1.5")], ["<c>", "2"]],
    "Sizes",
    "All.",
)


def test_every_cell_is_shown_everywhere():
    console = Console(width=80, record=True, file=io.StringIO())
    console.print(TABLE)
    shown = page("t", section("s", TABLE))
    words = ("who", "how much [m]", "a|b", "1.0", "0.5 … 1.5", "<c>", "2", "Sizes")
    for text in (
        console.export_text(),
        html.unescape(shown),
        html.unescape(markdown_table(TABLE)).replace("\\|", "|"),
    ):
        assert [word for word in words if word not in text] == []
    assert "<c>" not in shown
    assert '<td class="quiet" title="why">' in shown
    assert "a\\|b" in markdown_table(TABLE)


def test_a_part_is_replaced_between_its_marks():
    new = with_part("before\n\n<!-- run -->\nold\n<!-- end of run -->\n\nafter\n", "run", "new")
    assert "old" not in new
    assert new.startswith("before\n\n<!-- run -->\n\nnew\n")
    assert new.endswith("\n\nafter\n")
    with pytest.raises(HandrailError, match="once each"):
        with_part("<!-- run -->\nold\n", "run", "new")
