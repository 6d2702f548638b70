/* SPDX-License-Identifier: BSD-3-Clause */
/* The requested sets of equations and their derivation: kempe_generate_options, read. */
#pragma once

#include "studies/show/sets.h"
#include <kempe/generate.h>

enum { KMP_MOST_CHOSEN = 32, KMP_CHOICE_NAME = 40 };

typedef struct kmp_chosen {
    char name[KMP_CHOICE_NAME]; /* as written in the request: "M_C", "M_C+h_J" */
    unsigned sets;
    bool in_place; /* conditions have the values of the state, not of modes */
} kmp_chosen;

typedef struct kmp_set_choice {
    kmp_chosen chosen[KMP_MOST_CHOSEN];
    int count;
    unsigned all;                 /* the union */
    kmp_derivation_request scene; /* all but its sets */
    kmp_events modes;             /* of friction that sticks: the scene's inputs */
    const char *scheme;           /* the name of the algorithm */
} kmp_set_choice;

/** KEMPE_E_ARGUMENT: a set, scheme or body that does not exist, or a set that is empty for this model. The choice stays
 * where it is and lives no longer than the generation. To be freed in any case. */
kempe_status kmp_choice_read(const kempe_model *model, const kempe_generate_options *generation,
                             kmp_set_choice *choice);
void kmp_choice_free(kmp_set_choice *choice);
