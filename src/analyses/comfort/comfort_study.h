/* SPDX-License-Identifier: BSD-3-Clause */
#pragma once

#include "analyses/comfort/weighting.h"
#include "base/arena.h"
#include "base/json.h"
#include <kempe/comfort.h>
#include <kempe/kempe.h>
#include <stdbool.h>

typedef enum kmp_comfort_direction {
    KMP_COMFORT_LONGITUDINAL,
    KMP_COMFORT_LATERAL,
    KMP_COMFORT_VERTICAL,
    KMP_COMFORT_SEAT_BACK,
    KMP_COMFORT_SEAT,
    KMP_COMFORT_DIRECTIONS
} kmp_comfort_direction;

typedef struct kmp_comfort_row {
    const char *name;
    kmp_weighting weighting;
    bool sperling;
} kmp_comfort_row;

extern const kmp_comfort_row kmp_comfort_rows[KMP_COMFORT_DIRECTIONS];

typedef struct kmp_comfort_signal {
    kmp_comfort_direction direction;
    const char *name;
    double raw, weighted, median, percentile, largest, sperling; /* m/s^2, Wz; NaN: none */
    double difference;                                           /* relative, with every other sample */
    double *window;                                              /* weighted root mean squares */
} kmp_comfort_signal;

struct kempe_comfort {
    const kempe_system *system;
    kmp_arena arena;
    kempe_status status;
    char *warnings;
    const struct kmp_start_balance *balance; /* at which the run begins; NULL: at none */
    double from, rate;
    int windows, count, places;
    kmp_comfort_signal *signal;
};

/** Length of a window, s (EN 12299). */
#define KMP_COMFORT_WINDOW 5.0

/** Windows of a whole measurement: 5 min (EN 12299). */
enum { KMP_COMFORT_WINDOWS = 60 };

/** The results as members of an open object. */
void kmp_comfort_json(kmp_json *json, const kempe_comfort *comfort);
