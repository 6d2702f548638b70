/* SPDX-License-Identifier: BSD-3-Clause */
/* What a picture has of a model's wheels and tracks: a disc for each wheel, a line for each rail. */
#ifndef KMP_REPORT_RAILWAY_H
#define KMP_REPORT_RAILWAY_H

#include "base/text.h"
#include "model/model.h"

/** Where the bodies that move were: 3 numbers for each of them in each frame, the ground left out. */
typedef struct kmp_travel {
    int frames, bodies;
    const double *position;
} kmp_travel;

/** "discs":[..],"rails":[..], and nothing where there is no wheel. */
void kmp_railway_put(kmp_text *text, const kempe_model *model, const kmp_travel *travel);

#endif
