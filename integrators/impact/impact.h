/* SPDX-License-Identifier: BSD-3-Clause */
/* Impacts of rigid contacts. All contacts that are closed or touch at an instant are decided together. Their normal
 * impulses f and the rates v of their distances after the impact are related by v+ = v- + D f with D = G P G', P the
 * inverse inertia with the closures. Newton's law asks for v+ + e v- >= 0, f >= 0, with one of them zero: the minimum
 * of f'Df/2 + ((1 + e) v-)'f over f >= 0 (Glocker 2001, chapter 8). Friction joins with impulses of at most mu times
 * the normal one against the slip after the impact; its bounds are iterated.
 *
 * An impact whose next one would follow within KMP_IMPACT_SPACING of the run ends a sequence: it takes the rate away,
 * and the contact closes. */
#pragma once

#include "integrators/run/run.h"

typedef struct kmp_impact_run kmp_impact_run;

/** Makes the workspace in the run's arena, after that of friction. NULL: no memory, or there are no rigid contacts
 * (*none). */
kmp_impact_run *kmp_impact_new(kmp_runner *run, bool *none);

/** KEMPE_E_FAILED by name where surfaces overlap at the start. */
kempe_status kmp_impact_check_start(kmp_runner *run, double t, const double *q, const double *qd);

/** Changes rates at t where open contacts strike, and parts surfaces that overlap by rounding, with the rows of the
 * closures alone and articulated bodies off. *gain: change of the kinetic energy, J. */
kempe_status kmp_impact_pass(kmp_runner *run, double t, double *q, double *qd, double *gain);

/** Of the last decision at an event: the time since the impact before, of a contact that strikes twice; INFINITY if
 * none does. */
double kmp_impact_since(const kmp_impact_run *impacts);

/** Lists what impacts know of their past; returns the number of pieces. */
int kmp_impact_memory(kmp_impact_run *impacts, kmp_memory_piece *piece);

/** The number of impacts so far. */
long kmp_impact_count(const kmp_impact_run *impacts);
