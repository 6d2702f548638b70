/* SPDX-License-Identifier: BSD-3-Clause */
/* Options of a table of wheel contacts that are refused with some words. */
#ifndef KEMPE_TESTS_REFUSED_CONTACTS_H
#define KEMPE_TESTS_REFUSED_CONTACTS_H

#include "loaded.h"
#include <kempe/vehicle.h>
#include <string.h>

static inline void refuses(const loaded *l, kempe_contact_options options, const char *words)
{
    kempe_contacts *table = NULL;
    CHECK(kempe_contacts_new(l->system, &options, &table) == KEMPE_E_ARGUMENT);
    CHECK(table == NULL);
    if (!strstr(kempe_context_message(l->context), words))
        CHECK_TEXT(kempe_context_message(l->context), words);
}

#endif
