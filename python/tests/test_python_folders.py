# SPDX-License-Identifier: BSD-3-Clause
"""Result folders: the rows of a batch, whatever threads, shares and interruptions made the parts."""

import kempe
import pytest
from conftest import ROOT
from test_python_parquet import read, same

COUNT, CHUNK = 40, 16


def bars(seed=1):
    four_bar = kempe.Model(ROOT / "examples/four_bar/four_bar.yaml")
    return four_bar.ensemble(four_bar.sample({"crank": (0.29, 0.31), "base": (0.88, 0.92)}, COUNT, seed=seed))


def test_rows_of_a_batch(tmp_path):
    ensemble = bars()
    batch = ensemble.run(t_end=0.2)
    folder = ensemble.run_folder(tmp_path / "bars.kempe", chunk=CHUNK, t_end=0.2)
    assert (len(folder), folder.parts, folder.whole) == (COUNT, 3, 3) and "3 of 3" in repr(folder)
    assert "40 instances in 3 parts of 16" in str(folder)
    first = 0
    for path in sorted((tmp_path / "bars.kempe").glob("*.parquet")):
        columns, notes = read(path)
        assert list(columns) == list(batch.instances.names) and notes["kempe.first"] == str(first)
        rows = len(columns["t"])
        for name, values in columns.items():
            assert same(values, list(batch.instances[name])[first : first + rows]), name
        first += rows
    assert first == COUNT
    assert same(batch.q[5:9].ravel(), ensemble.run_range(5, 4, t_end=0.2).q.ravel())
    with pytest.raises(kempe.ArgumentError, match="no 3 instances from 38"):
        ensemble.run_range(38, 3)


def test_shares(tmp_path):
    ensemble, place = bars(), tmp_path / "bars.kempe"
    half = ensemble.run_folder(place, chunk=CHUNK, shard="1/2", t_end=0.2)
    assert (half.parts, half.whole) == (3, 2)
    assert kempe.Folder.open(place).to_dict()["missing"] == 1
    with pytest.raises(kempe.InputError, match="--resume runs what is missing"):
        ensemble.run_folder(place, t_end=0.2)
    with pytest.raises(kempe.InputError, match="the seed is 1 in the folder and 2 in this run"):
        bars(seed=2).run_folder(place, resume=True, t_end=0.2)
    with pytest.raises(kempe.InputError, match="t_end is 0.2 in the folder and 0.3"):
        ensemble.run_folder(place, resume=True, t_end=0.3)
    assert ensemble.run_folder(place, resume=True, t_end=0.2).whole == 3
    with pytest.raises(kempe.InputError, match="manifest.json is missing"):
        kempe.Folder.open(tmp_path)


def test_interrupt_keeps_parts(tmp_path):
    """A failure of the progress function ends the run as Ctrl-C does."""
    place, seen = tmp_path / "bars.kempe", []

    def stop(progress):
        seen.append(progress)
        if progress.done > 25:
            raise RuntimeError("enough")

    ensemble = bars()
    ensemble._context.on_count(stop, 0)
    with pytest.raises(RuntimeError, match="enough"):
        ensemble.run_folder(place, chunk=CHUNK, t_end=0.2, threads=1)
    ensemble._context.on_count(None)
    assert kempe.Folder.open(place).whole == 1 and all(each.total == COUNT for each in seen)
    assert ensemble.run_folder(place, resume=True, t_end=0.2).whole == 3
    assert ensemble.run_folder(tmp_path / "other.kempe", chunk=CHUNK, t_end=0.2).whole == 3
    for path in place.iterdir():
        assert path.read_bytes() == (tmp_path / "other.kempe" / path.name).read_bytes()
