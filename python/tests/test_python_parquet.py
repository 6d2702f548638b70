# SPDX-License-Identifier: BSD-3-Clause
"""Parquet files: read by a small reader below, and by pyarrow, Polars and DuckDB where they are installed."""

import math
import struct

import numpy as np
import pytest

import kempe

MODEL = """kempe: 1
name: pendulum
gravity: [0, -9.81, 0]
parameters: {length: 1 m}
bodies: {bar: {joint: {name: A, revolute: z, at: ground}, mass: 1, com: [length, 0, 0]}}
start: {q: {A: 0.5}}
run: {t_end: 1 s, output_step: 1 ms}
"""


class Thrift:
    """Structs of the compact protocol as {field: value}."""

    def __init__(self, data, at):
        self.data, self.at = data, at

    def byte(self):
        self.at += 1
        return self.data[self.at - 1]

    def varint(self):
        x = shift = 0
        while True:
            b = self.byte()
            x |= (b & 0x7F) << shift
            shift += 7
            if b < 0x80:
                return x

    def signed(self):
        x = self.varint()
        return (x >> 1) ^ -(x & 1)

    def value(self, kind):
        if kind in (5, 6):
            return self.signed()
        if kind == 8:
            length = self.varint()
            self.at += length
            return self.data[self.at - length : self.at].decode()
        if kind == 9:
            head = self.byte()
            count = head >> 4 if head >> 4 < 15 else self.varint()
            return [self.value(head & 15) for _ in range(count)]
        assert kind == 12, kind
        return self.struct()

    def struct(self):
        fields, last = {}, 0
        while head := self.byte():
            assert head >> 4, "short form of fields"
            last += head >> 4
            fields[last] = self.value(head & 15)
        return fields


def read(path):
    """Columns and units of a file of plain, required values."""
    data = path.read_bytes()
    assert data[:4] == data[-4:] == b"PAR1"
    size = struct.unpack("<I", data[-8:-4])[0]
    footer = Thrift(data, len(data) - 8 - size)
    meta = footer.struct()
    assert footer.at == len(data) - 8
    names = [element[4] for element in meta[2][1:]]
    assert meta[2][0][5] == len(names) and all(element[3] == 0 for element in meta[2][1:])
    columns, end = {}, 4
    for chunk, element in zip(meta[4][0][1], meta[2][1:]):
        inner, values = chunk[3], []
        assert inner[3] == [element[4]] and inner[9] == end and inner[1] == element[1]
        page = Thrift(data, end)
        end += inner[7]
        while page.at < end:
            head = page.struct()
            at, page.at = page.at, page.at + head[3]
            for _ in range(head[5][1]):
                if element[1] == 5:
                    values.append(struct.unpack_from("<d", data, at)[0])
                    at += 8
                else:
                    length = struct.unpack_from("<I", data, at)[0]
                    values.append(data[at + 4 : at + 4 + length].decode())
                    at += 4 + length
            assert at == page.at
        assert len(values) == inner[5] == meta[3]
        columns[element[4]] = values
    return columns, {pair[1]: pair[2] for pair in meta.get(5, [])}


def same(a, b):
    return len(a) == len(b) and all(x == y or (x != x and y != y) for x, y in zip(a, b))


def tables():
    model = kempe.Model.from_text(MODEL)
    yield model.simulate(t_end=1).table("rows")
    batch = model.ensemble({"length": [1.0, 2.0, -0.0, math.nan]}).run(t_end=0.01)
    yield batch.table("instances")


@pytest.fixture(params=[0, 1], ids=["numbers", "words"])
def written(request, tmp_path):
    table = list(tables())[request.param]
    path = tmp_path / "table.parquet"
    table.write(path)
    again = tmp_path / "again.parquet"
    table.write(again)
    assert path.read_bytes() == again.read_bytes()
    return table, path


def wanted(table):
    return {name: list(table[name]) for name in table.names}


def test_own_reader(written):
    table, path = written
    columns, units = read(path)
    expected = wanted(table)
    assert list(columns) == list(expected)
    assert all(same(columns[name], expected[name]) for name in expected)
    assert units["unit.t"] == "s" and units["unit.q.A"] == "rad"


def test_pyarrow(written):
    parquet = pytest.importorskip("pyarrow.parquet")
    table, path = written
    found, expected = parquet.read_table(path), wanted(table)
    assert found.column_names == list(expected)
    assert all(same(found[name].to_pylist(), expected[name]) for name in expected)
    assert parquet.ParquetFile(path).metadata.metadata[b"unit.t"] == b"s"


def test_polars(written):
    polars = pytest.importorskip("polars")
    table, path = written
    found, expected = polars.read_parquet(path), wanted(table)
    assert found.columns == list(expected)
    assert all(same(found[name].to_list(), expected[name]) for name in expected)


def test_duckdb(written):
    duckdb = pytest.importorskip("duckdb")
    table, path = written
    found = duckdb.sql(f"select * from '{path}'")
    expected = wanted(table)
    assert found.columns == list(expected)
    assert all(same([row[k] for row in found.fetchall()], expected[name]) for k, name in enumerate(expected))


def test_several_pages(tmp_path):
    """150,000 rows are three pages a column."""
    model = kempe.Model.from_text(MODEL)
    table = model.simulate(t_end=1.5, output_step=1e-5, no_convergence_check=True).table("rows")
    table.write(tmp_path / "long.parquet")
    columns, _ = read(tmp_path / "long.parquet")
    assert np.array_equal(columns["t"], table["t"]) and len(columns["t"]) == 150001
