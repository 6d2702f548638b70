#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""The mesh of the blade: a box of aluminium in solid elements of 27 nodes, with its stiffness and its consistent mass (needs NumPy):

    python3 mesh_flexible_blade.py blade_mesh.npz

Shape functions of a box are products of functions of x, of y and of z. So are the integrals over it: matrices of three lines.
"""
import sys

import numpy as np

SIZE, ELEMENTS = (0.5, 0.06, 0.008), (10, 2, 1)
YOUNG, POISSON, DENSITY = 71e9, 0.33, 2750.0


def line(length, elements):
    """The integrals of N N', N dN' and dN dN' over a line of elements with three nodes."""
    half = length / elements / 2
    nodes = np.arange(2 * elements + 1)
    sums = np.zeros((3, len(nodes), len(nodes)))
    for e in range(elements):
        own = np.ix_(nodes[2 * e:2 * e + 3], nodes[2 * e:2 * e + 3])
        for xi, weight in zip(*np.polynomial.legendre.leggauss(3)):
            N = np.array([xi * (xi - 1) / 2, 1 - xi**2, xi * (xi + 1) / 2])
            dN = np.array([xi - 0.5, -2 * xi, xi + 0.5]) / half
            for k, (a, b) in enumerate(((N, N), (N, dN), (dN, dN))):
                sums[k][own] += weight * half * np.outer(a, b)
    return sums


LINES = [line(length, elements) for length, elements in zip(SIZE, ELEMENTS)]


def integral(i=None, j=None):
    """Of the slope of each function along i times the slope of each other one along j, over the box."""
    factors = []
    for axis, (plain, right, both) in enumerate(LINES):
        factors.append(both if axis == i == j else right.T if axis == i else right if axis == j else plain)
    return np.kron(np.kron(factors[0], factors[1]), factors[2])


def mesh():
    """Nodes, the stiffness matrix of their displacements, and the mass matrix, which is the same for x, y and z."""
    shear = YOUNG / (2 * (1 + POISSON))
    bulk = YOUNG * POISSON / ((1 + POISSON) * (1 - 2 * POISSON))
    ends = ((0, SIZE[0]), (-SIZE[1] / 2, SIZE[1] / 2), (-SIZE[2] / 2, SIZE[2] / 2))
    lines = [np.linspace(*end, 2 * n + 1) for end, n in zip(ends, ELEMENTS)]
    nodes = np.stack(np.meshgrid(*lines, indexing="ij"), axis=-1).reshape(-1, 3)
    slopes = sum(integral(c, c) for c in range(3))
    stiffness = np.zeros((len(nodes), 3, len(nodes), 3))
    for i in range(3):
        for j in range(3):
            stiffness[:, i, :, j] = bulk * integral(i, j) + shear * integral(j, i) + (shear * slopes if i == j else 0)
    return nodes, stiffness.reshape(3 * len(nodes), -1), DENSITY * integral()


def main():
    nodes, stiffness, mass = mesh()
    arrays = {"nodes": nodes, "units": "m kg s"}
    for name, matrix in (("stiffness", stiffness), ("mass", mass)):
        row, col = np.nonzero(matrix)
        arrays |= {f"{name}_row": row, f"{name}_col": col, f"{name}_value": matrix[row, col]}
    np.savez_compressed(sys.argv[1], **arrays)


if __name__ == "__main__":
    main()
