/* SPDX-License-Identifier: BSD-3-Clause */
/* A model's wheels and tracks in a picture: a disc for each wheel, a line for each rail. */
#pragma once

#include "base/json.h"
#include "model/model.h"

/** Positions of the moving bodies: 3 numbers for each in each frame, without the ground. */
typedef struct kmp_travel {
    int frames, bodies;
    const double *position;
} kmp_travel;

/** The members discs and rails, and nothing where there is no wheel. */
void kmp_railway_put(kmp_json *json, const kempe_model *model, const kmp_travel *travel);
