/* SPDX-License-Identifier: BSD-3-Clause */
/* Numbers, places in the header of a state, and results of an evaluation. A part of kempe_simulator.c. */
#pragma once

#include "base/bracket.h"
#include "exchange/simulator/kempe_simulator.h"
#include "integrators/decide/closing.h"
#include "integrators/decide/conditions.h"
#include "integrators/decide/coordinate_exchange.h"
#include "integrators/decide/dropped_rows.h"
#include "integrators/decide/endless_growth.h"
#include "integrators/decide/event_location.h"
#include "integrators/decide/restart.h"
#include "integrators/decide/run_start.h"
#include "integrators/decide/step_control.h"
#include "integrators/steppers/explicit_methods.h"
#include "integrators/steppers/sample_times.h"
#include "linalg/dense/factors.h"

#include <stdarg.h>
#include <stdio.h>
#include <string.h>

enum { MOST_LOADS = 50, MOST_PARTS = 256, MOST_HALVINGS = 24 };

/* Numbers that a structure fills. */
#define KEMPE_NUMBERS_OF(type) ((sizeof(type) + sizeof(double) - 1) / sizeof(double))

/* Places in the header of the state. */
enum {
    AT_T,
    AT_BEGIN, /* of the last step, from which its dense output counts */
    AT_END,   /* of the last step, or an event within it */
    AT_TAKEN, /* length of the step that was made; 0: none */
    AT_METHOD_TAKEN,
    AT_NEXT,
    AT_ERROR,
    AT_REJECTED,
    AT_HOPELESS,
    AT_DENSE,    /* vectors of the dense output are there */
    AT_COARSE,   /* they are too inexact: further steps take their place */
    AT_FRESH,    /* the derivative at the end is not there */
    AT_EVENT,    /* modes change at the end, by `flip` */
    AT_EXCHANGE, /* the choice is bad at the end */
    AT_ENDED,    /* 1 + the condition that ends the motion at the end; 0 */
    AT_SIGN,     /* of det Jv, block by block */
    AT_RATE,     /* of the motion at the start, 1/s */
    AT_LOOSE,    /* largest h of a redundant row at the start */
    AT_STARTED,
    AT_BAD, /* the choice is bad at the present state for an integrator of the caller */
    AT_SETTINGS,
    AT_WORK = AT_SETTINGS + KEMPE_NUMBERS_OF(kempe_simulator_settings),
    AT_RANK = AT_WORK + KEMPE_NUMBERS_OF(kempe_simulator_work),
    AT_TRIED,                                                /* attempted steps since the start */
    AT_GROWTH,                                               /* numbers of kmp_growth */
    AT_CORRECTED = AT_GROWTH + KEMPE_NUMBERS_OF(kmp_growth), /* numbers of kmp_last_correction */
    AT_PAST_CORRECTED = AT_CORRECTED + KEMPE_NUMBERS_OF(kmp_last_correction),
    HEADER = 48
};

/* Results of an evaluation. */
typedef enum outcome { GOOD, OPEN, SINGULAR_LOOPS, SINGULAR_MASS, NOT_FINITE, UNSETTLED, MOVED_ANGLES, TOLD } outcome;

typedef char kinds_are_those[(int)KMP_CONDITION_TOLD == KEMPE_CONDITION_TOLD ? 1 : -1];
typedef char header_fits[AT_PAST_CORRECTED <= HEADER ? 1 : -1];

/* Sets the message: the name of the mechanism, then a sentence. */
#ifdef __GNUC__
__attribute__((format(printf, 2, 3)))
#endif
static kempe_simulator_status
fail_with(kempe_simulator *s, const char *format, ...)
{
    va_list arguments;
    int used = snprintf(s->message, sizeof s->message, "%s: ", s->equations->name);
    used = used < (int)sizeof s->message ? used : (int)sizeof s->message - 1;
    va_start(arguments, format);
    vsnprintf(s->message + used, sizeof s->message - (size_t)used, format, arguments);
    va_end(arguments);
    return KEMPE_SIMULATOR_FAILED;
}

static const kmp_rk_numbers methods[] = {KMP_DOP853_NUMBERS, KMP_DOPRI5_NUMBERS};
