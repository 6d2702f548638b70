/* SPDX-License-Identifier: BSD-3-Clause */
/* Time scales of the functions only of time in forces, closures and rates of states. A pulse that is much shorter than
 * the steps of a calm motion lies between the places at which an integrator evaluates it. Its place and width follow
 * from bounds of the function before the run: intervals of time are halved until the function is known by its values at
 * their ends and middles. Conditions and kinks are events, and inputs have samples: both have separate limits. */
#pragma once

#include "base/arena.h"
#include <kempe/kempe.h>
#include <stdbool.h>

/** Intervals of a run from its start on, where some are much shorter than others; otherwise none. */
typedef struct kmp_time_scales {
    int count;
    double *end;      /* ascending */
    double shortest;  /* interval, INFINITY without any */
    const char *open; /* of a function with too many short intervals: where it is; NULL: there is none */
    int open_count;   /* functions that were studied together with it, itself among them */
    long halvings;    /* of intervals, in all */
    bool varies;      /* some functions depend on parameters that may vary */
} kmp_time_scales;

/** The functions whose intervals are found: functions that may have short ones, where some are much shorter than
 * others; or all, since friction that sticks and closed contacts keep a motion at rest under loads that vary, where no
 * error of a step shows when a load exceeds the friction. Of these a function that may jump counts by its parts:
 * conditions are events, and a jump has no shortest interval. */
typedef enum kmp_timed_functions { KMP_TIMED_SHORT, KMP_TIMED_ALL } kmp_timed_functions;

/** Finds them with values of the parameters, in the arena. KEMPE_E_MEMORY. */
kempe_status kmp_time_scales_find(const kempe_model *model, const double *parameters, double from, double to,
                                  kmp_timed_functions which, kmp_arena *arena, kmp_time_scales *found);

/** Doubts the result where functions have too many short intervals; true if it does. With a longest step that the user
 * gives, `max_step` > 0, it does not, and forgets these intervals. */
bool kmp_time_scales_doubt(kempe_context *context, kmp_time_scales *scales, double max_step);

/** The shortest interval of a run of the model as it is; 0: steps need no limit. */
double kmp_time_scales_shortest(const kempe_model *model);

/** The name of a force, closure or state with a function of time that may have a short pulse, whose width depends on
 * parameters; NULL: there is none. */
const char *kmp_time_scales_varying(const kempe_model *model);

/** The end of the interval in which a step from t begins; INFINITY: there is none. */
double kmp_time_scales_end(const kmp_time_scales *scales, double t);
