# SPDX-License-Identifier: BSD-3-Clause
"""Result folders: the rows of a batch, whatever threads, shares and interruptions made the parts."""

import pickle
import struct

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
    assert "40 instances, all passed" in str(folder) and "3 of 3 parts whole" in str(folder)
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


def test_histories(tmp_path):
    """Histories of a folder equal the histories of the ensemble, and rows of single runs."""
    ensemble = bars()
    folder = ensemble.run_folder(tmp_path / "bars.kempe", chunk=CHUNK, t_end=0.2, output_step=0.05, history="2,39:40")
    folder.write_history(tmp_path / "gathered.csv")
    table = ensemble.history("2,39:40", t_end=0.2, output_step=0.05)
    table.write(tmp_path / "table.csv")
    assert (tmp_path / "gathered.csv").read_bytes() == (tmp_path / "table.csv").read_bytes()
    assert list(table["instance"]) == [2] * 5 + [39] * 5 + [40] * 5
    ends = ensemble.run(t_end=0.2).q[[1, 38, 39]]
    assert abs(ends[:, 0] - table["q.crank"][4::5]).max() < 1e-7
    with pytest.raises(kempe.ArgumentError, match="no instances 41 to 41: there are 1 to 40"):
        ensemble.history("41")
    with pytest.raises(kempe.ArgumentError, match="has no histories"):
        ensemble.run_folder(tmp_path / "other.kempe", chunk=CHUNK, t_end=0.1).write_history(tmp_path / "no.csv")


def test_gathered(tmp_path):
    """The file of all parts equals the file of the batch, to the byte; Parquet's groups of rows agree with other readers."""
    ensemble, place = bars(), tmp_path / "bars.kempe"
    folder = ensemble.run_folder(place, chunk=CHUNK, t_end=0.2)
    table = ensemble.run(t_end=0.2).instances
    folder.check()
    for ending in ("csv", "parquet", "npz", "mat"):
        folder.write(tmp_path / f"gathered.{ending}")
        table.write(tmp_path / f"table.{ending}")
        assert (tmp_path / f"gathered.{ending}").read_bytes() == (tmp_path / f"table.{ending}").read_bytes()
    folder.write(tmp_path / "units.csv", units=True)
    assert "q.crank [rad]" in (tmp_path / "units.csv").read_text().splitlines()[0]
    part = folder.part(2)
    assert part.names == table.names and same(part["q.crank"], table["q.crank"][2 * CHUNK :])
    (place / "part-000001.parquet").write_bytes((place / "part-000002.parquet").read_bytes())
    with pytest.raises(kempe.FailedError, match=r"part-000001.parquet: it is another part; remove it"):
        folder.check()
    (place / "part-000001.parquet").unlink()
    with pytest.raises(kempe.FailedError, match="1 of 3 parts is missing: 1; the run with resume makes it"):
        folder.write(tmp_path / "missing.csv")
    assert not (tmp_path / "missing.csv").exists()


def test_instance(tmp_path):
    """One instance in a single run: in the folder, and again, to the bit."""
    ensemble, place = bars(), tmp_path / "bars.kempe"
    folder = ensemble.run_folder(place, lanes=-1, chunk=CHUNK, t_end=0.2)
    k = 2 * CHUNK + 3
    model = kempe.Model(folder.model_file).instance(place, k)
    assert folder.run_options["integrator"] == "dop853" and folder.run_options["t_end"] == 0.2
    assert model.parameters["crank"] == folder.part(2)["crank"][3]
    motion = model.simulate(**folder.run_options)
    assert abs(motion.q[-1] - ensemble.run_range(k, 1, t_end=0.2).q[0]).max() < 1e-8
    with pytest.raises(kempe.InputError, match="the results belong to another model"):
        kempe.Model(folder.model_file, rocker=0.72).instance(place, k)
    again = pickle.loads(pickle.dumps(model))
    assert (again.simulate(**folder.run_options).q == motion.q).all()


def field(head, value):
    """A field of Thrift's compact protocol whose number is the number of the last one plus head >> 4."""
    if head & 15 in (5, 6):
        value = 2 * value
        return bytes([head, *([value & 127 | 128, value >> 7 & 127 | 128, value >> 14] if value > 127 else [value])])
    return bytes([head]) + (bytes([len(value)]) + value if head & 15 == 8 else value)


def written(columns):
    """A small Parquet file of required doubles, by the specification of the format."""
    data, chunks, rows = b"PAR1", b"", len(next(iter(columns.values())))
    for name, values in columns.items():
        page = struct.pack(f"<{rows}d", *values)
        inner = field(0x15, rows) + field(0x15, 0) + field(0x15, 3) + field(0x15, 3) + b"\0"
        pages = field(0x15, 0) + field(0x15, len(page)) + field(0x15, len(page)) + b"\x2c" + inner + b"\0" + page
        meta = field(0x15, 5) + b"\x19\x15\x00" + b"\x19\x18" + bytes([len(name)]) + name.encode() + field(0x15, 0)
        sizes = field(0x16, rows) + field(0x16, len(pages)) + field(0x16, len(pages)) + field(0x26, len(data)) + b"\0"
        chunks += field(0x26, len(data)) + b"\x1c" + meta + sizes + b"\0"
        data += pages
    count = len(columns)
    schema = field(0x48, b"schema") + field(0x15, count) + b"\0"
    schema += b"".join(field(0x15, 5) + field(0x25, 0) + field(0x18, name.encode()) + b"\0" for name in columns)
    group = b"\x19" + bytes([count << 4 | 12]) + chunks + field(0x16, 1) + field(0x16, rows) + b"\0"
    footer = field(0x15, 1) + b"\x19" + bytes([(count + 1) << 4 | 12]) + schema + field(0x16, rows) + b"\x19\x1c" + group + b"\0"
    return data + footer + struct.pack("<I", len(footer)) + b"PAR1"


def test_values_of_files(tmp_path):
    """Values from Parquet: of a small writer, and of pyarrow where it is installed."""
    four_bar = kempe.Model(ROOT / "examples/four_bar/four_bar.yaml")
    csv, own = tmp_path / "bars.csv", tmp_path / "bars.parquet"
    csv.write_text("crank,base\n0.29,0.9\n0.3,0.91\n0.31,0.92\n")
    with pytest.raises(kempe.InputError, match="not a Parquet file, or a damaged one"):
        own.write_bytes(csv.read_bytes())
        four_bar.values(own)
    expected = [list(row) for row in four_bar.values(csv)]
    columns = {"crank": [0.29, 0.3, 0.31], "base": [0.9, 0.91, 0.92]}
    own.write_bytes(written(columns))
    assert [list(row) for row in four_bar.values(own)] == expected
    own.write_bytes(written({**columns, "crnk": [1, 2, 3]}))
    with pytest.raises(kempe.InputError, match="no parameter 'crnk'; did you mean 'crank'"):
        four_bar.values(own)
    own.write_bytes(written({"crank": [0.3, float("nan"), 0.31]}))
    with pytest.raises(kempe.InputError, match="column 'crank', row 2: a finite number is expected"):
        four_bar.values(own)
    for size in range(len(written(columns))):  # a file that is cut anywhere is refused
        own.write_bytes(written(columns)[:size])
        with pytest.raises(kempe.InputError, match="not a Parquet file, or a damaged one"):
            four_bar.values(own)
    parquet = pytest.importorskip("pyarrow.parquet")
    pyarrow = pytest.importorskip("pyarrow")
    table = pyarrow.table(columns)
    for version in ("1.0", "2.0"):
        parquet.write_table(table, own, compression="none", use_dictionary=False, data_page_version=version)
        assert [list(row) for row in four_bar.values(own)] == expected
    for options in ({}, {"use_dictionary": False}, {"compression": "none"}, {"data_page_version": "2.0"}):
        parquet.write_table(table, own, **options)  # as pandas does: Snappy, dictionaries
        assert [list(row) for row in four_bar.values(own)] == expected
    parquet.write_table(table, own, compression="gzip")
    with pytest.raises(kempe.InputError, match=r"column 'crank' is compressed \(gzip\)"):
        four_bar.values(own)
    table = pyarrow.table({"crank": [0.29, None, 0.31]})
    parquet.write_table(table, own, compression="none", use_dictionary=False)
    with pytest.raises(kempe.InputError, match="column 'crank' has empty cells"):
        four_bar.values(own)


def test_shares(tmp_path):
    ensemble, place = bars(), tmp_path / "bars.kempe"
    half = ensemble.run_folder(place, chunk=CHUNK, shard="1/2", t_end=0.2)
    assert (half.parts, half.whole) == (3, 2)
    assert kempe.Folder.open(place).to_dict()["missing"] == 1
    with pytest.raises(kempe.InputError, match="resume runs what is missing"):
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
