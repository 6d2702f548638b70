/* SPDX-License-Identifier: BSD-3-Clause */
/* A filter of signals. */
#pragma once

#include <stdbool.h>

/** Low-pass filter of signals whose samples are not equally spaced: Butterworth's of fourth order: 24 dB an octave, -3
 * dB at the cutoff frequency, Hz. Signals begin at rest in their first value, and are straight between samples. Every
 * stride-th of the samples at t (count, increasing) is read and written; sample k of signal s is number s * count + k.
 * false: no memory. */
bool kmp_low_pass(double cutoff, int count, int stride, const double *t, int signals, const double *in, double *out);
