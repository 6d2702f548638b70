/* SPDX-License-Identifier: BSD-3-Clause */
/* The joints that two bearings may carry. */
#include "model/data/bearing_pair.h"
#include "model/data/coordinates.h"
#include "model/data/model.h"
#include <math.h>

/* Axes are normalized: their cosine differs from 1 by rounding. */
#define PARALLEL 1e-9

static bool is_parallel(const kmp_motion *a, const kmp_motion *b)
{
    const double cosine = a->axis[0] * b->axis[0] + a->axis[1] * b->axis[1] + a->axis[2] * b->axis[2];
    return fabs(fabs(cosine) - 1) <= PARALLEL;
}

int kmp_pin_motion(const kempe_model *model, int body)
{
    const kmp_body *b = &model->bodies[body];
    const int first = kmp_joint_first_free(b), end = first + kmp_joint_free_count(b);
    int turn = -1, turns = 0, slides = 0;
    for (int k = first; k < end; k++) {
        turn = model->motions[k].rotation ? k : turn;
        turns += model->motions[k].rotation;
        slides += !model->motions[k].rotation;
    }
    if (turns != 1 || slides > 1 || b->coupling)
        return -1;
    for (int k = first; k < end; k++)
        if (!is_parallel(&model->motions[k], &model->motions[turn]))
            return -1;
    return turn;
}

bool kmp_pin_slides(const kempe_model *model, const kmp_bearing_pair *pair)
{
    return pair->closure >= 0 ? model->closures[pair->closure].kind == KMP_CLOSURE_cylindrical
                              : kmp_joint_free_count(&model->bodies[pair->body]) > 1;
}
