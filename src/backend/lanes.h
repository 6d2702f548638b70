/* SPDX-License-Identifier: BSD-3-Clause */
/* A program prepared for several instances at once, one per lane: the same operations on separate inputs. Every
 * value is `width` adjacent doubles, one per lane. Each lane has the bits that a machine (machine.h) has with its
 * inputs. */
#pragma once

#include "symbolic/program.h"
#include <string.h>

typedef struct kmp_lanes kmp_lanes;

enum { KMP_LANES_MOST = 16 };

/** The number of lanes in which this machine runs independent instances best: 16 with AVX-512, 4 with AVX and on arm64,
 * otherwise 8 without machine code. */
int kmp_lanes_best(void);

/** `width` lanes, 1 to KMP_LANES_MOST. Of 1, 4, 8 and 16 the arithmetic is machine code where that runs and `plain`
 * does not forbid it: of 16 in two registers of eight, of 8 in two of four where there are none of eight; on arm64 in
 * two registers of two for each four lanes. Otherwise there are loops over the lanes. The program must outlive it.
 * NULL: no memory. Stage 0 must be run after parameters are set. */
kmp_lanes *kmp_lanes_new(const kmp_program *program, int width, bool plain);

/** Finds sines and cosines of n values in slots, as kmp_sincos_lanes; the first is number `first` of the angles of the
 * program. */
typedef void kmp_lanes_sincos(void *user, int first, int n, double *v, const uint32_t *x, const uint32_t *s,
                              const uint32_t *c);

/** Takes other sines and cosines than a machine; outputs then have other roundings. The number of all angles.
 */
void kmp_lanes_set_sincos(kmp_lanes *lanes, kmp_lanes_sincos *sincos, void *user);
int kmp_lanes_angles(const kmp_lanes *lanes);

/** Copies sines and cosines from the lanes of another program, of the same width, where that has found them of the same
 * bits: at each run of these lanes, of a stage after the first, it must have been run since it got its inputs, and it
 * must outlive them. false: no memory. */
bool kmp_lanes_borrow_sines(kmp_lanes *lanes, const kmp_lanes *from);

void kmp_lanes_free(kmp_lanes *lanes);

/** True if it runs as machine code. */
bool kmp_lanes_native(const kmp_lanes *lanes);

/** Gives the values of one input vector: of all lanes, value k of lane l at k width + l; and of one lane. */
void kmp_lanes_set(kmp_lanes *lanes, kmp_input_kind kind, const double *values);
void kmp_lanes_set_one(kmp_lanes *lanes, kmp_input_kind kind, int lane, const double *values);

/** True if the program takes some value of an input vector. */
bool kmp_lanes_takes(const kmp_lanes *lanes, kmp_input_kind kind);

/** Finds where each value of an input vector is, for callers that write `width` numbers there themselves; NULL: the
 * program does not have it. */
void kmp_lanes_places(kmp_lanes *lanes, kmp_input_kind kind, int count, double **place);

/** Runs one stage, whose earlier stages are up to date. Output k of lane l is at k width + l, owned by the lanes, valid
 * until the stage runs again. No allocation. */
const double *kmp_lanes_run(kmp_lanes *lanes, int stage);

/** An output where a stage leaves it: its value is the value of all lanes there, times the factor 1 or -1. */
typedef struct kmp_lanes_output {
    const double *value;
    double factor;
} kmp_lanes_output;

/** Finds where a stage leaves each of its outputs; runs a stage without their copies, which kmp_lanes_run makes. */
void kmp_lanes_outputs(const kmp_lanes *lanes, int stage, kmp_lanes_output *output);
void kmp_lanes_run_in_place(kmp_lanes *lanes, int stage);

/** Brings the outputs [first, end) of a stage that was run in place to kmp_lanes_values. */
void kmp_lanes_gather(kmp_lanes *lanes, int stage, int first, int end);

/** The outputs of a stage that have been gathered: width numbers for each. */
const double *kmp_lanes_values(const kmp_lanes *lanes, int stage);
