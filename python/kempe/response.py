# SPDX-License-Identifier: BSD-3-Clause
"""Frequency response."""

from __future__ import annotations

from .result import Drawn, Reported, TableOf


class Response(Reported, Drawn):
    """Steady-state response of outputs to harmonic inputs near an equilibrium."""

    _noun = "response"
    rows: TableOf = TableOf("frequency (Hz), OUTPUT/INPUT.amplitude and OUTPUT/INPUT.phase (degrees) of each pair.")
    peaks: TableOf = TableOf("Maxima of amplitudes: input, output, frequency (Hz), amplitude, phase, gain, unit.")
