/* SPDX-License-Identifier: BSD-3-Clause */
/* Separate runs of an instance: from its start to its end if lanes cannot run it; or from where a lane left it to
 * where lanes can take it back. A part begins and ends where the instance alone says so. */
#pragma once

#include "ensemble/lanes/ensemble_inside.h"

/** Repeats an instance in a separate run from its start. */
kempe_status kmp_instance_alone(kmp_engine *e, int i);
/** Continues an instance from t and y in a separate run, until lanes can take it back or to its end. `margin`: that of
 * the closures over its usual size; 0: the run finds it. If such a run fails, the instance is left to one from its
 * start. The second begins such a run at a state with closures of this rank. */
kempe_status kmp_instance_apart(kmp_engine *e, kmp_lane_group *from, int i, double margin, const char *why);
kempe_status kmp_instance_start_apart(kmp_engine *e, int i, int rank, double margin, const double *q, const double *qd,
                                      double work, const char *why);
