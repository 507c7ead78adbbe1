"""A study's file from whoever it is: a design, or one line; whatever is put into it."""

import pytest
from command_helpers import refused
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from study_helpers import DESIGN
from toml_helpers import mutated

from handrail.controllers.errors import HandrailError
from handrail.policies.study.load import load_design

QUICK = settings(max_examples=100, suppress_health_check=[HealthCheck.function_scoped_fixture])


def one_line_or_a_design(path) -> None:
    refusals = []
    try:
        load_design(str(path))
    except HandrailError as error:
        refusals.append(str(error))
    assert "\n" not in "".join(refusals)


@given(data=st.data())
@QUICK
def test_an_entry_of_another_kind_is_one_line(tmp_path, data):
    path = tmp_path / "study.toml"
    path.write_text(mutated(DESIGN, data))
    one_line_or_a_design(path)


@given(data=st.data())
@QUICK
def test_another_text_is_one_line(tmp_path, data):
    text = DESIGN.encode()
    first, last = sorted(data.draw(st.integers(0, len(text))) for _ in range(2))
    path = tmp_path / "study.toml"
    path.write_bytes(text[:first] + data.draw(st.binary(max_size=8)) + text[min(last, first + 20) :])
    one_line_or_a_design(path)


@pytest.mark.parametrize(
    "content",
    [b"\xff\xfe", b"", b"a = " + b"[" * 100_000, b"a = " + b"9" * 10_000, b"#" * 2**21],
    ids=["bytes", "empty", "deep", "digits", "large"],
)
def test_what_is_no_design_is_one_line(content, tmp_path):
    path = tmp_path / "study.toml"
    path.write_bytes(content)
    refused("--preset", path, "--output", tmp_path / "study", name="study")
    assert not (tmp_path / "study").exists()
