"""Collections of packings in files: patterns, frames, and files that change."""

from __future__ import annotations

import pytest

from etc_engine.errors import InputError
from etc_engine.particle_files.collection import find_sources
from etc_engine.particle_files.sample import Sample

FRAME = (
    "ITEM: TIMESTEP\n{k}\nITEM: NUMBER OF ATOMS\n1\nITEM: BOX BOUNDS pp pp ff\n0 1\n0 1\n0 2\n"
    "ITEM: ATOMS id x y z radius\n1 0.5 0.5 0.{k} 0.25\n"
)


@pytest.fixture
def beds(tmp_path):
    (tmp_path / "beds").mkdir()
    for name, count in (("b.dump", 3), ("a.dump", 2)):
        (tmp_path / "beds" / name).write_text("".join(FRAME.format(k=k + 1) for k in range(count)))
    return tmp_path


def test_files_and_frames_come_in_order(beds):
    found = find_sources(beds, "beds/*.dump")
    assert [(source.name, source.frame) for source in found] == [("beds/a.dump", 1), ("beds/b.dump", 2)]
    assert [source.frame for source in find_sources(beds, "beds/*.dump", "all")] == [0, 1, 0, 1, 2]
    assert [source.frame for source in find_sources(beds, "beds/*.dump", [0, -1])] == [0, 1, 0, 2]
    assert found[1].read().packing.centers[0, 2] == 0.3
    assert len({source.digest for source in found}) == 2


def test_a_crop_holds_for_all(beds):
    (source,) = find_sources(beds, "beds/a.dump", sample=Sample(crop=((0.0, 1.0), (0.0, 1.0), (0.0, 0.5))))
    packing = source.read().packing
    assert packing.box.lengths == (1.0, 1.0, 0.5)
    assert packing.box.periodic == (True, True, False)


def test_what_is_not_there_or_has_changed_is_refused(beds):
    with pytest.raises(InputError, match="no file matches 'none/"):
        find_sources(beds, "none/*.dump")
    with pytest.raises(InputError, match="holds 2 frames, numbered from 0: there is no frame 2"):
        find_sources(beds, "beds/*.dump", [2])
    (source,) = find_sources(beds, "beds/a.dump")
    source.path.write_text(FRAME.format(k=7))
    with pytest.raises(InputError, match="has changed since the sweep began"):
        source.read()
