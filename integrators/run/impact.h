/* SPDX-License-Identifier: BSD-3-Clause */
/* Impacts of rigid contacts in a run: the decision of impact_inside.h, with sentences and log. */
#pragma once

#include "integrators/impact/impact_inside.h"
#include "integrators/run/run.h"

typedef struct kmp_impacts {
    kmp_impact_site site;
    kmp_impact_run run;
} kmp_impacts;

/** Makes the workspace in the run's arena, after the workspace of friction. NULL: no memory, or there are no rigid
 * contacts
 * (*none). */
kmp_impacts *kmp_impact_new(kmp_runner *run, bool *none);

/** KEMPE_E_FAILED by name where surfaces overlap at the start. */
kempe_status kmp_impact_check_start(kmp_runner *run, double t, const double *q, const double *qd);

/** Of the last decision at an event: the time since the impact before, of a contact that strikes twice; INFINITY if
 * none does. */
double kmp_impact_since(const kmp_impacts *impacts);

/** Lists what impacts know of their past; returns the number of pieces. Their size in all. */
int kmp_impact_memory(kmp_impacts *impacts, kmp_memory_piece *piece);
size_t kmp_impact_memory_size(const kmp_events *events);
