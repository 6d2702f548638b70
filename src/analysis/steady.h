/* SPDX-License-Identifier: BSD-3-Clause */
/* Coordinates that keep on moving at constant rates, as users name them: "shaft=60 rpm,belt=2". */
#ifndef KMP_ANALYSIS_STEADY_H
#define KMP_ANALYSIS_STEADY_H

#include "model/model.h"

typedef struct kmp_steady {
    int coordinate;
    double rate;
} kmp_steady;

/** Reads a list (NULL: an empty one), to be freed by kmp_free. KEMPE_E_ARGUMENT: what in it is wrong. */
kempe_status kmp_steady_read(const kempe_model *model, const char *text, int *count, kmp_steady **rates);

/** The coordinate NAME, with spaces before it; -1 after a sentence that begins with `what`. */
int kmp_steady_coordinate(const kempe_model *model, const char *name, const char *what);

/** KEMPE_E_FAILED: something depends on a coordinate that shall go on at a rate. */
kempe_status kmp_steady_complain(const kempe_model *model, const kmp_steady *steady);

#endif
