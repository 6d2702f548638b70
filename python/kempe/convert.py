# SPDX-License-Identifier: BSD-3-Clause
"""The command that writes a flexible body of Exudyn as a file of kempe-flexible-1:

    python -m kempe.convert arm_fem.npz arm.npz --interface A=left --interface B=right
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence

from .errors import Error
from .exudyn import convert_exudyn, read_exudyn


def main(words: Sequence[str] | None = None) -> int:
    """The command: 0, or 2 where the file is refused."""
    parser = argparse.ArgumentParser(prog="python -m kempe.convert", description="A flexible body of Exudyn as a file of kempe-flexible-1.")
    parser.add_argument("file", help="written by FEMinterface.SaveToFile: .npz, .npy or .pkl")
    parser.add_argument("output", help="the file of kempe-flexible-1, .npz")
    parser.add_argument("--interface", action="append", default=[], metavar="NAME=SET", help="a set of nodes as an interface, or numbers of nodes between commas; without the option all sets are")
    parser.add_argument("--units", default="m kg s", help="units of length, mass and time of the file (default: m kg s)")
    given = parser.parse_args(words)
    interfaces: dict[str, str | list[int]] = {}
    for word in given.interface:
        name, sign, nodes = word.partition("=")
        if not (name and sign and nodes):
            parser.error(f"--interface {word}: NAME=SET is expected")
        numbers = nodes.split(",")
        interfaces[name] = [int(x) for x in numbers] if all(x.isdigit() for x in numbers) else nodes
    try:
        convert_exudyn(read_exudyn(given.file), given.output, interfaces or None, given.units)
    except Error as error:
        print(f"kempe.convert: {error}", file=sys.stderr)
        return 2
    return 0


if __name__ == "__main__":
    sys.exit(main())
