/* SPDX-License-Identifier: BSD-3-Clause */
/* Maps of a motion without sensitivities, for the adjoint method. */
#pragma once

#include "analyses/sensitivity/forward_inside.h"

/** Takes another number of columns, and what depends on it. */
void kmp_forward_set_columns(kmp_forward_formulation *f, int count);

/** The unknowns with which a motion without sensitivities, at (t, y), passes an event: with the columns of a map, which
 * begins if a step has ended since the last one. NULL: the reason is reported. The second function ends it: reports the
 * map, and puts the motion behind the event into y. */
double *kmp_forward_map_begin(kmp_forward_formulation *f, double t, const double *y);
int kmp_forward_map_end(kmp_forward_formulation *f, double *y);

/** Goes on with the map that has begun, at the start of a formulation: its columns; and its unknowns, from the
 * place. */
void kmp_forward_map_go_on(kmp_forward_formulation *f);
double *kmp_forward_map_unknowns(kmp_forward_formulation *f);

/** A step has ended: the next event has a separate map. */
void kmp_forward_map_end_step(kmp_forward_formulation *f);

/** True if an event with states came just before the one that is passed. */
bool kmp_forward_map_follows_event(const kmp_forward_formulation *f);

/** The size of the quantity by which a column that does not belong to a parameter differentiates. */
double kmp_forward_map_column_size(const kmp_forward_formulation *f, int column);

/** A new requirement of the map, with room for its rows, of `terms` terms. NULL: no memory. */
kmp_forward_requirement *kmp_forward_map_require(kmp_forward_formulation *f, int terms, double **off, double **term);

/** True if other independent coordinates of a motion without sensitivities, taken now, need a map without columns. */
bool kmp_forward_map_exchanges(const kmp_forward_formulation *f);

/** Such a map from (t, y). False: the state cannot be evaluated. The second function reports it. */
bool kmp_forward_map_begin_exchange(kmp_forward_formulation *f, double t, const double *y);
int kmp_forward_map_end_exchange(kmp_forward_formulation *f);

/** Begins the map of the start, with the columns of parameters in the place. False: no memory. */
bool kmp_forward_map_begin_start(kmp_forward_formulation *f);
