"""Result files: a checksum sees flipped bits, damaged files are refused in time, a failing machine leaves no result."""

from __future__ import annotations

import netCDF4
import numpy as np
import pytest
import xarray as xr

from etc_engine.durable import apart
from etc_engine.errors import OutputError
from etc_engine.sweep import result_file
from etc_engine.sweep.result_file import checksum, open_dataset, write_dataset


@pytest.fixture
def dataset():
    rng = np.random.Generator(np.random.PCG64(97))
    return xr.Dataset(
        {
            "conductivity": (("density", "realization"), rng.random((3, 40))),
            "status": (("density", "realization"), np.zeros((3, 40), dtype=np.int8)),
            "solved_by": (("density", "realization"), np.full((3, 40), "full", dtype=object)),
        },
        coords={"density": [0.6, 0.7, 0.8]},
        attrs={"study_digest": "0" * 64},
    )


def test_a_file_comes_back_with_its_checksum(dataset, tmp_path):
    write_dataset(dataset, tmp_path / "out.nc")
    back = open_dataset(tmp_path / "out.nc")
    assert back.attrs["checksum"] == checksum(dataset) == checksum(back)
    xr.testing.assert_identical(back.drop_attrs(), dataset.drop_attrs())


def test_a_flipped_bit_of_the_data_is_seen(dataset, tmp_path):
    """A bit in the exponent turns 0.1 into a number that looks like a result."""
    path = tmp_path / "out.nc"
    write_dataset(dataset, path)
    content = bytearray(path.read_bytes())
    where = content.find(dataset.conductivity.values[1, 7].tobytes())
    content[where + 6] ^= 0x10
    path.write_bytes(content)
    with pytest.raises(OutputError, match="checksum"):
        open_dataset(path)


@pytest.mark.parametrize("change", [{"density": [0.6, 0.7, 0.81]}, {"status": "float"}, {"conductivity": "transposed"}])
def test_the_checksum_is_of_names_types_and_coordinates(dataset, change):
    other = dataset.copy()
    if "density" in change:
        other = other.assign_coords(density=change["density"])
    elif "status" in change:
        other["status"] = other["status"].astype(np.float64)
    else:
        other["conductivity"] = other["conductivity"].T
    assert checksum(other) != checksum(dataset)


def test_damaged_files_are_refused_and_none_hangs(dataset, tmp_path, monkeypatch):
    """Cut and scribbled copies of one file; a few of them are read as they were, none gives other numbers."""
    monkeypatch.setattr(apart, "SECONDS", 10.0)
    write_dataset(dataset, tmp_path / "good.nc")
    content, rng = (tmp_path / "good.nc").read_bytes(), np.random.Generator(np.random.PCG64(1234))
    for number in range(6):
        damaged = bytearray(content)
        if number < 2:
            damaged = damaged[: int(rng.integers(8, len(damaged)))]
        else:
            for place in rng.integers(0, len(damaged), 3):
                damaged[place] ^= 1 << int(rng.integers(8))
        path = tmp_path / f"{number}.nc"
        path.write_bytes(damaged)
        try:
            assert checksum(open_dataset(path)) == checksum(dataset)
        except OutputError as error:
            assert str(path) in str(error)


def test_a_reader_that_does_not_end_is_given_up(dataset, tmp_path, monkeypatch):
    write_dataset(dataset, tmp_path / "out.nc")
    monkeypatch.setattr(result_file, "NETCDF", "while True: pass")
    monkeypatch.setattr(apart, "SECONDS", 0.5)
    with pytest.raises(OutputError, match="did not finish"):
        open_dataset(tmp_path / "out.nc")


@pytest.mark.parametrize("error", [MemoryError("no room"), OSError(28, "No space left on device")])
def test_a_failing_machine_leaves_no_result(error, monkeypatch):
    from types import SimpleNamespace

    from etc_engine.sweep.plan import Unit
    from etc_engine.sweep.sweep import run_unit

    def fail(_spec, _rng):
        raise error

    with pytest.raises(OutputError, match="continue with --resume"):
        run_unit(SimpleNamespace(seed=5, for_realization=lambda spec, _: spec), None, Unit(0.7, 3), 0, fail)


def test_attributes_belong_to_the_checksum_except_in_older_files(dataset, tmp_path):
    """An attribute decides the confidence level of every figure; files of earlier versions stay readable."""
    write_dataset(dataset, tmp_path / "out.nc")
    with netCDF4.Dataset(tmp_path / "out.nc", "a") as file:
        file.study_digest = "1" + "0" * 63
    with pytest.raises(OutputError, match="checksum"):
        open_dataset(tmp_path / "out.nc")
    older = dataset.assign_attrs(checksum=checksum(dataset, attributes=False))
    older.to_netcdf(tmp_path / "older.nc", engine="netcdf4")
    assert open_dataset(tmp_path / "older.nc").attrs["study_digest"] == "0" * 64
