"""However rows are cut into row groups, and in whatever order they lie, an episode's rows are found."""

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
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
            found = opened.open(path).rows(episode, ["place"])
            assert found.column("place").to_pylist() == expected
