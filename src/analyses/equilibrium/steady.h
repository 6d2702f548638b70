/* SPDX-License-Identifier: BSD-3-Clause */
/* Coordinates that keep on moving at constant rates, as users name them: "shaft=60 rpm,belt=2". */
#pragma once

#include "analyses/parts/ranges.h"
#include "base/arena.h"
#include "base/text.h"
#include <kempe/kempe.h>

typedef enum kmp_steady_options {
    KMP_RATE_GIVEN, /* and R = 0 along it */
    KMP_RATE_HELD,  /* given, by any necessary load; the position is fixed */
    KMP_RATE_FREED, /* found, so that R = 0 along it; it stays where it is */
    KMP_RATE_KEPT   /* the rate of the start, which no force determines; R = 0 along it */
} kmp_steady_options;

typedef struct kmp_steady {
    int coordinate;
    double rate;
    kmp_steady_options how;
    double load; /* of KMP_RATE_HELD, at the state that was found: N or N m */
} kmp_steady;

/** Reads a list (NULL: an empty one) into an array of `arena` with room for all coordinates. KEMPE_E_ARGUMENT: the
 * error in it. */
kempe_status kmp_steady_read(const kempe_model *model, const char *text, kmp_arena *arena, int *count,
                             kmp_steady **rates);

/** Converts ranges: an entry of `rates`, as above, for each range, with its first value. `*varies`: the one range with
 * two ends, -1: none; NULL: none is allowed. Errors as kmp_steady_read. */
kempe_status kmp_steady_take(const kempe_model *model, const kmp_ranges *ranges, kmp_arena *arena, int *varies,
                             kmp_steady **rates);

/** Appends "x at 15 m/s as at the start, spin at 32.6 rad/s" or "x at 15 m/s by a force of 40 N (600 W)", with the
 * rates of qd (n): the coordinates that move steadily. */
void kmp_steady_list(kmp_text *text, const kempe_model *model, int count, const kmp_steady *rates, const double *qd);

/** KEMPE_E_FAILED: forces depend on a coordinate that is to move at a constant rate. */
kempe_status kmp_steady_complain(const kempe_model *model, const kmp_steady *steady);
