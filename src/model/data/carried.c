/* SPDX-License-Identifier: BSD-3-Clause */
/* The joint that a name selects for its load, and the reason if it has none. */
#include "model/data/carried.h"
#include "model/data/model.h"
#include <string.h>

int kmp_joint_find(const kempe_model *model, const char *name)
{
    for (int b = 1; b < model->body_count; b++)
        if (strcmp(model->bodies[b].joint, name) == 0)
            return b;
    return -1;
}

const char *kmp_joint_obstacle(const kempe_model *model, int body)
{
    const kmp_body *b = &model->bodies[body];
    int first = kmp_joint_first_free(b), changes = 0;
    for (int k = first + 1; k < first + kmp_joint_free_count(b); k++)
        changes += model->motions[k].rotation != model->motions[k - 1].rotation;
    return kmp_joint_free_count(b) == 0
               ? "it is a weld, whose bodies are one; with 'cut: yes', or as a loop 'weld', it has a reaction"
           : changes > 1 ? "it has translations before and after a rotation"
                         : NULL;
}
