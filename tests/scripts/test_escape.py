"""Nothing that a dataset says steers a terminal, or is markup, a formula or a line of its own.

Two datasets are alike but for their words: one's are plain, the other's a stranger's. Whatever a command
prints of the second holds no control character; what it writes has the tags, links and cells of the first.
"""

import csv
import io
import json
import re
import unicodedata
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from canned import copied
from command_helpers import command, ran
from datasets_helpers import FPS, REPO
from hypothesis import given
from hypothesis import strategies as st
from markdown_it import MarkdownIt

from handrail.controllers.errors import HandrailError
from handrail.datasets.format.manifest import Manifest
from handrail.datasets.format.schema import Feature
from handrail.datasets.presentation.markdown import markdown_table, markdown_text
from handrail.datasets.presentation.table import Cell, Table
from handrail.datasets.presentation.terminal import Terminal
from handrail.datasets.printable import printable
from handrail.datasets.recording.writer import EpisodeWriter
from handrail.scripts import cli

PLAIN, FORGED = "plain", "saved: all is well"
STEERING = "\x1b[2J\x1b]0;pwned\x07\x9b1A\x08\x7f\u202egnp\u2066\u200b\u2028"
LIVE = (
    "<script>alert(1)</script>",
    "![x](http://evil.example/p.png)[y](javascript:alert(1))<http://evil.example>",
    f"a | b\n# heading\n\n{FORGED}\r\n---\n- item\n```",
    "=HYPERLINK(1)",
    r'$\frac{$ `code` *x* [bold red] [/] :smile: " onload="x" &lt;b&gt;',
)
STRANGE = [word + STEERING for word in LIVE]
LENGTH, EPISODES = 24, 4


def dataset(root, words):
    """Record a dataset that says some words wherever words can stand."""
    task, mode, operator, reason, robot = words
    names = [f"{word}{place}" for place, word in enumerate(words)]
    features = {
        "observation.state": Feature("float32", (5,), tuple(names)),
        "observation.environment_state": Feature("float32", (5,), tuple(reversed(names))),
        "action": Feature("float32", (5,), tuple(names)),
        "teleop.values": Feature("float32", (5,), tuple(names)),
        "teleop.mask": Feature("bool", (5,), tuple(names)),
        "teleop.mode": Feature("string"),
        "teleop.device": Feature("string"),
        "controller.smallest_distance": Feature("float32"),
    }
    rng = np.random.default_rng(0)
    with EpisodeWriter.create(root, Manifest(REPO, FPS, robot, features)) as writer:
        for episode in range(EPISODES):
            for index in range(LENGTH + episode):
                move = np.sin(0.1 * index + np.arange(5)) + 0.01 * rng.normal(size=5)
                numbers = {key: move.astype(np.float32) for key in list(features)[:4]}
                said = {"teleop.mode": mode, "teleop.device": "", "controller.smallest_distance": 0.1}
                writer.add_frame(numbers | said | {"teleop.mask": np.ones(5, bool)}, f"{task}{episode % 2}")
            texts = {"mode": mode, "operator": operator, "robot": robot, "robot_client": robot}
            texts["environment"] = f"{task}{episode % 2}"
            texts["settings"] = json.dumps({"task": task, "mode": mode, "robot": robot})
            texts |= {words[place].replace("/", ""): words[0] for place in (0, 2)}  # columns of a stranger's
            ended = {"success": episode % 2 == 0, "failure_reason": reason * (episode % 2), "seed": 1}
            writer.save_episode(ended | texts)
    (root / f"{words[3]}.txt".replace("/", "")[:80]).write_text("x")
    (root / "data" / f"{words[1]}".replace("/", "")[:80]).write_text("x")
    return root


def plain_and_strange(folder):
    """Record a plain dataset and a stranger's, whose folder's name is such words too."""
    dataset(folder / "plain", [f"{PLAIN} {place}" for place in range(5)])
    dataset(folder / "strange" / f"{STEERING}{LIVE[3]}\n{FORGED}", STRANGE)


@pytest.fixture(autouse=True)
def _errors_have_any_words(monkeypatch):
    """What a stranger calls a folder stands in an error as it is; here it counts what is printed of it."""
    monkeypatch.setattr(HandrailError, "__init__", Exception.__init__)


@pytest.fixture
def sets(tmp_path):
    """Return copies of both."""
    root = copied(tmp_path / "sets", plain_and_strange)
    return root / "plain", next((root / "strange").iterdir())


def unseen(text):
    """Return what steers, hides or breaks a line, line breaks aside."""
    return {each for each in text if each != "\n" and unicodedata.category(each) in ("Cc", "Cf", "Zl", "Zp")}


def check_printed(done):
    """Check that a command's words are lines of text, none of them a stranger's."""
    for text in (done.stdout, done.stderr):
        assert not unseen(text), (unseen(text), text)
        assert not re.search(rf"^\s*({FORGED}|# heading|- item)", text, re.MULTILINE), text
        assert "Traceback" not in text


class Tags(HTMLParser):
    """The tags of a page, with the names of what they carry and where their pictures are."""

    def __init__(self, text):
        super().__init__()
        self.found = []
        self.feed(text)

    def handle_starttag(self, tag, attrs):
        """Take a tag."""
        leads = [value.partition(",")[0][:40] for name, value in attrs if name in ("src", "href")]
        self.found.append((tag, [name for name, _ in attrs], leads))


def markdown_shape(text):
    """Return the kinds of the pieces of a Markdown page, and where its links and pictures lead."""
    front, _, body = (
        text.removeprefix("---").partition("\n---\n") if text.startswith("---") else ("", "", text)
    )
    parts = []
    for token in MarkdownIt("commonmark").enable("table").parse(body):
        for piece in [token, *(token.children or ())]:
            if piece.type != "text":
                html = piece.content if piece.type.startswith("html") else ""
                parts.append((piece.type, piece.attrs.get("src"), piece.attrs.get("href"), html))
    return front, parts


COMMANDS = {
    "inspect": ("inspect", "{}"),
    "quality": ("inspect", "{}", "--quality"),
    "worst": ("inspect", "{}", "--worst", "length"),
    "check": ("inspect", "{}", "--check"),
    "repair": ("repair", "{}"),
    "set aside": ("repair", "{}", "--set_aside"),
    "compare": ("compare", "{}", "{plain}", "--output", "{out}"),
    "compare groups": ("compare", "{}", "--by", "environment", "--output", "{out}"),
    "compare what": ("compare", "{}", "--by", "environments", "--output", "{out}"),
    "delete": ("edit", "delete", "{}", "--episodes", "failed", "--output", "{out}"),
    "keep": ("edit", "keep", "{}", "--episodes", "0", "--in_place"),
    "split": ("edit", "split", "{}", "--parts", "a=0.5", "b=0.5", "--output", "{out}"),
    "trim": ("edit", "trim", "{}", "--output", "{out}"),
    "relabel": ("edit", "relabel", "{}", "--episodes", "0", "--label", "success", "--output", "{out}"),
    "rename": ("edit", "rename", "{}", "--task", "x", "--output", "{out}"),
    "rename what": ("edit", "rename", "{}", "--task", "x", "--old_task", "y", "--output", "{out}"),
    "merge": ("merge", "{}", "{plain}", "--output", "{out}"),
    "pack": ("pack", "{}", "--output", "{out}"),
    "pack in place": ("pack", "{}"),
    "push": ("push", "{}", "--dataset.repo_id", "me/x"),
    "replay": ("replay", "{}"),
    "train": ("train", "{}", "--output", "{out}", "--steps", "1"),
}


@pytest.mark.parametrize("name", COMMANDS)
def test_a_stranger_s_dataset_is_printed_as_text(name, sets, tmp_path):
    script, *words = COMMANDS[name]
    plain, strange = sets
    places = {"plain": plain, "out": tmp_path / "out"}
    done = command(*(word.format(strange, **places) for word in words), name=script)
    check_printed(done)
    assert done.returncode == 0 or script != "inspect" or name == "check", done.stderr


BROKEN = {
    "no such column": lambda root: _change_info(root, lambda info: info["features"].pop("action")),
    "robot": lambda root: _change_info(root, lambda info: info.update(robot_type=STRANGE[0] + "\ud800")),
    "version": lambda root: _change_info(root, lambda info: info.update(codebase_version=STRANGE[2])),
    "a feature's type": lambda root: _change_info(
        root, lambda info: info["features"].update({STRANGE[1]: 3})
    ),
    "a path": lambda root: _change_info(root, lambda info: info.update(data_path=STRANGE[4])),
    "no JSON": lambda root: (root / "meta/info.json").write_text(STRANGE[2]),
    "the manifest": lambda root: (root / "meta/handrail.json").write_text(
        json.dumps({STRANGE[0]: STRANGE[1]})
    ),
    "settings": lambda root: _change_lines(root, "settings", STRANGE[2]),
    "tasks": lambda root: _change_lines(root, "tasks", STRANGE),
    "the seal": lambda root: pq.write_table(
        pq.read_table(_line(root)).replace_schema_metadata({"handrail": STRANGE[2]}), _line(root)
    ),
}


def _change_info(root, change):
    info = json.loads((root / "meta/info.json").read_text())
    change(info)
    (root / "meta/info.json").write_text(json.dumps(info))


def _line(root):
    return next(root.glob("meta/episodes/*/file-001.parquet"))


def _change_lines(root, column, value):
    for path in root.glob("meta/episodes/*/*.parquet"):
        table = pq.read_table(path)
        place = table.column_names.index(column)
        pq.write_table(table.set_column(place, column, pa.array([value])), path)


@pytest.mark.parametrize("fault", BROKEN)
@pytest.mark.parametrize("script", ["inspect", "repair", "pack", "push", "replay", "compare"])
def test_an_error_about_a_stranger_s_dataset_is_a_line_of_text(script, fault, sets, tmp_path):
    root = sets[1]
    BROKEN[fault](root)
    more = {"push": ["--dataset.repo_id", "me/x"], "compare": ["--output", tmp_path / "out"]}.get(script, [])
    check_printed(command(root, *more, name=script))


def test_a_terminal_that_takes_colours_is_steered_by_nobody_else(sets, monkeypatch):
    monkeypatch.setenv("FORCE_COLOR", "1")
    shown = command(sets[1], name="inspect")
    assert "\x1b[1m" in shown.stdout  # the title's
    own = re.compile(r"\x1b\[[0-9;]*m")
    check_printed(type(shown)(0, own.sub("", shown.stdout), own.sub("", shown.stderr)))


def test_a_dataset_s_card_has_the_shape_of_a_plain_one(sets):
    for root in sets:
        ran(root, "--dataset.repo_id", "me/x", name="edit push")
    plain, strange = ((root / "README.md").read_text() for root in sets)
    assert markdown_shape(strange) == markdown_shape(plain)
    assert "alert(1)" in strange  # it is told, as text


def test_a_report_has_the_tags_and_the_rows_of_a_plain_one(sets, tmp_path):
    for place, root in enumerate(sets):
        ran(root, "--by", "environment", "--output", tmp_path / str(place), name="compare")
    plain, strange = (tmp_path / "0", tmp_path / "1")
    text = (strange / "report.html").read_text()
    assert Tags(text).found == Tags((plain / "report.html").read_text()).found
    assert not unseen(text)
    for path in strange.glob("*.csv"):
        rows = list(csv.reader(io.StringIO(path.read_text())))
        others = list(csv.reader(io.StringIO((plain / path.name).read_text())))
        assert [len(row) for row in rows] == [len(row) for row in others]
        for cell in (cell for row in rows for cell in row):
            assert not re.match(r"[=+@]|-[^0-9]", cell)
            assert not unseen(cell.replace("\t", ""))


ANY = st.text(st.characters(codec=None), max_size=40)


@given(ANY)
def test_no_text_steers(text):
    said = printable(text)
    assert not [each for each in said if unicodedata.category(each) in ("Cc", "Cs", "Zl", "Zp")]
    assert not set(said) & set("\u202a\u202b\u202c\u202d\u202e\u2066\u2067\u2068\u2069\u200e\u200f")
    assert printable(said) == said
    assert said == text or "\\" in said


@given(ANY, ANY, ANY)
def test_a_terminal_shows_only_its_own_line_breaks(text, heading, below):
    stream = io.StringIO()
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("sys.stdout", stream)
        Terminal().print(text)
        assert stream.getvalue() == printable(text) + "\n"
        Terminal().print(Table((heading or "-",), [[text], [Cell(text, below=below)]], caption=text))
    assert not unseen(stream.getvalue())


@given(st.sampled_from(LIVE) | st.text("<>&![]()`*_~\\|#-:/.wxa1 \n", max_size=30))
def test_markdown_shows_any_text_as_it_is(text):
    page = MarkdownIt("commonmark").enable("table")
    (line,) = [token for token in page.parse(f"- x {markdown_text(text)}") if token.type == "inline"]
    assert {piece.type for piece in line.children or ()} <= {"text", "text_special", "softbreak"}
    assert "".join(piece.content for piece in line.children or ()) == f"x {printable(text)}".rstrip(" ")
    cells = [
        each
        for each in page.parse(markdown_table(Table(("h", "i"), [["a", text]])))
        if each.type == "td_open"
    ]
    assert len(cells) == 2


def test_the_cockpit_s_page_sets_words_as_text():
    page = Path(cli.__file__).parents[1] / "collect/cockpit/page"
    live = re.compile(r"(inner|outer)HTML|insertAdjacentHTML|document\.write|srcdoc|createContextualFragment")
    assert [path.name for path in page.glob("*.js") if live.search(path.read_text())] == []
    assert len(list(page.glob("*.js"))) > 20
