"""Records and shards: every bit comes back, damage is recognised, a full disk loses nothing."""

from __future__ import annotations

import json
import os
import random
import subprocess
import sys
from dataclasses import asdict
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from etc_engine.box import Box
from etc_engine.durable.files import write_atomically
from etc_engine.durable.provenance import this_run
from etc_engine.errors import OutputError
from etc_engine.medium.conduction import Conduction
from etc_engine.packing import PackingSpec, parse_radii
from etc_engine.realization import Outcome, Realization, RealizationSpec, Status
from etc_engine.study.sweep import parse_study
from etc_engine.sweep import gathering
from etc_engine.sweep.claim import recorded_runs
from etc_engine.sweep.dataset import assemble
from etc_engine.sweep.plan import Unit
from etc_engine.sweep.records import Record, decode, encode, failed_realization
from etc_engine.sweep.scheduler import Solo
from etc_engine.sweep.shards import ShardReader, ShardWriter, frame, read_study_file, unframe
from etc_engine.sweep.table import join, row_type, tabulate


def record(realization: int, value: float = 0.3, message: str = "") -> Record:
    cell = Outcome(Status.OK, message, np.array([[value, np.nan], [np.nan, -value]]), 5, 2, 3.3, 7, 9, 1e-12, 0.5)
    result = Realization(11, 0.7, 0.69, 0.25, (cell, cell, cell, cell))
    return Record(Unit(0.7, realization), result, 3, "node", 1.5, 2.5)


STUDY = parse_study("""
schema = 2
name = "shards"
seed = 20261
[packing]
radii = "uniform:0.01:0.02"
box = [1.0, 1.0]
density = 0.7
[contacts]
rule = "bonded"
contact_angle = [2.5, 5.0]
[conduction]
method = ["chord", "standard"]
[statistics]
realizations = 3
""")


def read(folder) -> list[Record]:
    reader = ShardReader(folder)
    return list(reader.read(reader.files()))


def bits(found: Record) -> bytes:
    return b"".join(cell.conductivity.tobytes() for cell in found.result.cells)


@settings(max_examples=100, deadline=None)
@given(st.floats(allow_nan=False), st.text(max_size=30))
def test_a_record_keeps_every_bit(value, message):
    there = record(4, value, message)
    line = encode(there)
    assert "\n" not in line
    back = decode(line)
    assert bits(back) == bits(there)
    assert encode(back) == line
    assert back.result.cells[2].message == message


def test_numpy_numbers_of_an_engine_become_plain():
    cell = Outcome(Status.OK, conductivity=np.eye(2), contacts=np.int64(3), coordination=np.float64(1.5))
    there = Record(Unit(None, 0), Realization(np.int64(2), 0.5, 0.5, 0.0, (cell,)), 0, "node", 0.0, 0.0)
    back = decode(encode(there))
    assert back.unit == Unit(None, 0)
    assert back.result.cells[0].contacts == 3


def test_an_exception_becomes_a_steady_one_line_message():
    packing = PackingSpec("advancing-front", parse_radii("equal:0.05"), Box((1.0, 1.0)))
    methods = tuple(Conduction("dtem", method) for method in ("chord", "standard", "enhanced"))
    two_angles = RealizationSpec(packing, "bonded", methods, axes={"contact_angle": (0.1, 0.2)})
    result = failed_realization(ValueError(f"bad\nthing {object()!r}"), two_angles)
    assert len(result.cells) == 6
    assert {cell.status for cell in result.cells} == {Status.ERROR}
    assert result.cells[0].message == "ValueError: bad thing <object object at 0x...>"


def test_what_is_written_is_read_from_many_ranks_and_in_pieces(tmp_path):
    reader = ShardReader(tmp_path)
    with ShardWriter(tmp_path, "run", 0) as zero, ShardWriter(tmp_path, "run", 1) as one:
        zero.append(record(0))
        one.append(record(1))
        assert [r.unit for r in reader.read(reader.files())] == [Unit(0.7, 0), Unit(0.7, 1)]
        zero.append(record(2))
        assert [r.unit for r in reader.read(reader.files())] == [Unit(0.7, 2)]
    assert reader.damaged == 0


def test_a_rank_without_units_leaves_no_file(tmp_path):
    with ShardWriter(tmp_path, "run", 0):
        pass
    assert not list(tmp_path.iterdir())


def test_a_shard_is_cut_at_every_length_without_losing_a_whole_line(tmp_path):
    with ShardWriter(tmp_path, "run", 0) as writer:
        for r in range(3):
            writer.append(record(r))
    data = writer.path.read_bytes()
    ends = [i + 1 for i, byte in enumerate(data) if byte == ord("\n")]
    for length in range(0, len(data) + 1, 7):
        writer.path.write_bytes(data[:length])
        assert len(read(tmp_path)) == sum(end <= length for end in ends)


@settings(max_examples=100, deadline=None)
@given(st.integers(0, 10**6), st.integers(1, 255))
def test_a_changed_byte_is_noticed(place, change):
    line = bytearray(frame(encode(record(1))))
    line[place % len(line)] ^= change
    assert unframe(bytes(line)) is None


def test_damaged_lines_are_counted_and_the_others_kept(tmp_path):
    with ShardWriter(tmp_path, "run", 0) as writer:
        for r in range(3):
            writer.append(record(r))
    data = bytearray(writer.path.read_bytes())
    data[data.index(b"\n") + 40] ^= 1
    writer.path.write_bytes(data)
    reader = ShardReader(tmp_path)
    assert [r.unit for r in reader.read(reader.files())] == [Unit(0.7, 0), Unit(0.7, 2)]
    assert reader.damaged == 1


def test_a_unit_run_twice_is_kept_once(tmp_path):
    for run in ("20260101", "20260102"):
        with ShardWriter(tmp_path, run, 0) as writer:
            writer.append(record(0))
            writer.append(record(1))
    table = join([tabulate(STUDY, read(tmp_path)), tabulate(STUDY, [record(1), record(2)])])
    assert table.units.tolist() == [[0, 0], [0, 1], [0, 2]]


def described_run(folder) -> bytes:
    run = this_run("20260101T000000-abc", 4, "slurm 17")
    (folder / f"{run.run}.run").write_bytes(frame(json.dumps(asdict(run))))
    assert recorded_runs(folder) == [run]
    return (folder / f"{run.run}.run").read_bytes()


@pytest.mark.parametrize("seed", range(1, 61))
def test_a_damaged_record_of_a_run_is_refused_with_what_to_do(tmp_path, seed):
    data, rng = bytearray(described_run(tmp_path)), random.Random(seed)
    damage = rng.choice(["cut", "flip", "zero"])
    if damage == "cut":
        del data[rng.randrange(len(data)) :]
    elif damage == "flip":
        data[rng.randrange(len(data))] ^= 1 << rng.randrange(8)
    else:
        start = rng.randrange(len(data))
        data[start : start + 16] = bytes(len(data[start : start + 16]))
    next(tmp_path.glob("*.run")).write_bytes(data)
    with pytest.raises(OutputError, match=r"\.run.* is damaged: remove it and continue with --resume"):
        recorded_runs(tmp_path)


def test_the_record_of_a_run_of_an_earlier_version_is_read(tmp_path):
    run = this_run("20260101T000000-abc", 4, "")
    (tmp_path / "old.run").write_text(json.dumps(asdict(run)))
    assert recorded_runs(tmp_path) == [run]
    (tmp_path / "old.run").write_text(json.dumps(asdict(run) | {"ranks": "4"}))
    with pytest.raises(OutputError, match="damaged"):
        recorded_runs(tmp_path)


@pytest.mark.parametrize("text", ["", "{}", "[]", "3", '{"digest": "a"}', '{"digest": 1, "study": {}}', "{" * 5000])
def test_a_damaged_note_of_the_study_is_no_note(tmp_path, text):
    (tmp_path / "study.json").write_text(text)
    assert read_study_file(tmp_path) is None


def test_the_order_of_shards_only_grows(tmp_path):
    reader = ShardReader(tmp_path)
    names = ["m", "z", "a"]
    for count, name in enumerate(names, start=1):
        with ShardWriter(tmp_path, name, 0) as writer:
            writer.append(record(count))
        assert [path.name[0] for path in reader.files()] == names[:count]


def test_a_table_holds_what_the_records_say():
    table = tabulate(STUDY, [record(2, 0.25, "a remark"), record(0, 0.5)])
    assert table.units.tolist() == [[0, 0], [0, 2]]
    assert table.rows["conductivity"][:, 1, 0, 1, 1].tolist() == [-0.5, -0.25]
    assert table.spelled("worker_host").tolist() == ["node", "node"]
    assert set(table.spelled("message")[0].ravel()) == {""}
    assert set(table.spelled("message")[1].ravel()) == {"a remark"}


def test_a_full_disk_is_told_and_leaves_whole_lines(tmp_path, monkeypatch):
    with ShardWriter(tmp_path, "run", 0) as writer:
        writer.append(record(0))
        write = os.write
        monkeypatch.setattr(os, "write", lambda file, data: _half_then_full(write, file, data))
        with pytest.raises(OutputError, match=r"No space left on device.*--resume"):
            writer.append(record(1))
        monkeypatch.undo()
        writer.append(record(2))
    reader = ShardReader(tmp_path)
    assert [r.unit for r in reader.read(reader.files())] == [Unit(0.7, 0), Unit(0.7, 2)]
    assert reader.damaged == 0


def _half_then_full(write, file, data):
    if len(data) < 200:
        raise OSError(28, "No space left on device")
    return write(file, data[: len(data) - 100])


def test_an_atomic_write_replaces_whole_files_only(tmp_path, monkeypatch):
    path = tmp_path / "file"
    write_atomically(path, b"one")
    monkeypatch.setattr(os, "fsync", _no_space)
    with pytest.raises(OSError, match="No space"):
        write_atomically(path, b"two")
    assert path.read_bytes() == b"one"
    assert [p.name for p in tmp_path.iterdir()] == ["file"]


def _no_space(_file):
    raise OSError(28, "No space left on device")


def test_units_that_do_not_appear_are_told(tmp_path, monkeypatch):
    monkeypatch.setattr(gathering, "VISIBLE_SECONDS", 0.0)
    with ShardWriter(tmp_path, "run", 0) as writer:
        writer.append(record(0))
    gatherer = gathering.Gatherer(STUDY, tmp_path, Solo())
    assert gatherer.gather_all(np.array([[0, 0]])).units.tolist() == [[0, 0]]
    with pytest.raises(OutputError, match=r"2 finished units do not appear .* the same folder"):
        gatherer.gather_all(np.array([[0, 0], [0, 1], [0, 2]]))


def test_a_shard_that_the_folder_does_not_show_yet_is_read_by_name(tmp_path):
    elsewhere = tmp_path / "elsewhere"
    elsewhere.mkdir()
    with ShardWriter(elsewhere, "run", 0) as writer:
        writer.append(record(1))
    gatherer = gathering.Gatherer(STUDY, tmp_path, Solo())
    assert gatherer.gather(elsewhere / "not-yet.shard").units.size == 0
    assert gatherer.gather(writer.path).units.tolist() == [[0, 1]]


MANY = """
schema = 2
name = "many"
seed = 20261
[packing]
radii = "uniform:0.01:0.02"
box = [1.0, 1.0]
density = 0.7
[contacts]
rule = "bonded"
contact_angle = 2.5
[statistics]
realizations = 2000
"""


def test_rank_0_holds_less_than_a_kilobyte_a_unit():
    study = parse_study(MANY)
    data = assemble(study, tabulate(study, []), {})
    # the table twice while its parts are joined; then the table, the dataset, and a copy of it while it is written
    assert 2 * row_type(study).itemsize < 1000
    assert row_type(study).itemsize + 2 * data.nbytes / 2000 < 1000


@pytest.mark.slow
def test_measured_memory_of_gathering_stays_below_a_kilobyte_a_unit():
    script = Path(__file__).parents[1] / "benchmarks" / "bench_gathering.py"
    done = subprocess.run(
        [sys.executable, script, "--units", "100000"], capture_output=True, text=True, check=True, timeout=600
    )
    assert float(done.stdout.split()[2]) < 1000


def test_portions_of_many_ranks_join_to_the_same_table(tmp_path, monkeypatch):
    for name in ("a", "b"):
        with ShardWriter(tmp_path, name, 0) as writer:
            for r in range(9):
                writer.append(record(r, 0.1 * r, f"remark {r % 3}"))
    whole = gathering.Gatherer(STUDY, tmp_path, Solo()).gather()
    monkeypatch.setattr(gathering, "PORTION", 8)  # two records at a time
    parts = gathering.Gatherer(STUDY, tmp_path, Solo()).gather()
    assert parts.units.tolist() == [[0, r] for r in range(9)]
    assert parts.rows.tobytes() == whole.rows.tobytes()
    assert parts.words == whole.words == ("", "node", "remark 0", "remark 1", "remark 2")
