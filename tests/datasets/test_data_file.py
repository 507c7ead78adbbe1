"""However rows are cut into row groups, and in whatever order they lie, an episode's rows are found."""

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from handrail.datasets.format import data_file


@st.composite
def files(draw):
    """Rows of some episodes, in order or not, cut anywhere, with statistics or without."""
    lengths = draw(st.lists(st.integers(1, 5), min_size=1, max_size=8))
    owner = np.repeat(draw(st.integers(0, 3)) + np.arange(len(lengths)), lengths)
    if draw(st.booleans()):
        owner = np.array(draw(st.permutations(owner.tolist())))
    cuts = sorted(draw(st.sets(st.integers(1, len(owner)), max_size=6)) | {len(owner)})
    return owner, cuts, draw(st.booleans())


@settings(max_examples=60, deadline=None)
@given(made=files())
def test_an_episode_is_found_however_its_file_is_cut(made, tmp_path_factory):
    owner, cuts, statistics = made
    path = tmp_path_factory.mktemp("file") / "file.parquet"
    lists = pa.FixedSizeListArray.from_arrays(pa.array(np.arange(2.0 * len(owner))), 2)
    table = pa.table({"nested": lists, "episode_index": owner, "place": np.arange(len(owner))})
    with pq.ParquetWriter(path, table.schema, write_statistics=statistics) as writer:
        for begin, end in zip([0, *cuts], cuts, strict=False):
            writer.write_table(table.slice(begin, end - begin))
    with data_file.data_files() as opened:
        for episode in range(owner.min() - 1, owner.max() + 2):
            expected = np.flatnonzero(owner == episode).tolist()
            found = opened.open(path).rows(episode, len(expected), ["place"])
            assert found.column("place").to_pylist() == expected


def test_the_last_few_files_stay_open(tmp_path, monkeypatch):
    monkeypatch.setattr(data_file, "MOST_OPEN", 2)
    one, two, three = paths = [tmp_path / name for name in "abc"]
    for path in paths:
        pq.write_table(pa.table({"episode_index": [0, 1]}), path)
    with data_file.data_files() as files:
        first, second = files.open(one), files.open(two)
        assert files.open(one) is first
        files.open(three)  # and the second, which was asked for least lately, is closed
        assert files.open(one) is first
        assert files.open(two) is not second
    for closed in (first, second):
        with pytest.raises(ValueError, match="closed"):
            closed.rows(0, 1)
