/* SPDX-License-Identifier: BSD-3-Clause */
#include "model/data/rope.h"
#include "model/data/model.h"
#include <string.h>

kmp_contact_words kmp_contact_words_of(const kempe_model *model, const char *contact)
{
    for (int k = 0; k < model->rope_count; k++)
        if (strcmp(model->ropes[k].name, contact) == 0)
            return (kmp_contact_words){"rope", "becomes taut", "becomes slack"};
    return (kmp_contact_words){"contact", "closes", "opens"};
}
