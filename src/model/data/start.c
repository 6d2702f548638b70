/* SPDX-License-Identifier: BSD-3-Clause */
#include "model/data/start.h"
#include "base/text.h"
#include "base/wings.h"
#include "model/data/model.h"
#include <string.h>

const kmp_start *kmp_model_start(const kempe_model *model)
{
    return &model->start;
}

bool kmp_start_read_at(const char *word, const char **at, kmp_text *complaint)
{
    static const char head[] = "equilibrium";
    const size_t length = sizeof head - 1;
    bool found = false;
    *at = NULL;
    if (strcmp(word, "start") == 0)
        return true;
    if (strncmp(word, head, length) != 0 || (word[length] && word[length] != ' ')) {
        kmp_text_printf(complaint,
                        "unknown state '%s': 'start', 'equilibrium', or 'equilibrium NAME=RATE,..' (a steady motion)",
                        word);
        return false;
    }
    for (const kmp_wing *const *wing = kmp_wings; *wing; wing++)
        found = found || (*wing)->balance;
    if (!found)
        kmp_text_put(complaint, "this build of Kempe finds no equilibrium; configure it with -DKEMPE_ANALYSES=ON");
    *at = found ? word : NULL;
    return found;
}
