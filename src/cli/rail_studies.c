/* SPDX-License-Identifier: BSD-3-Clause */
#include "study.h"

/* The conicities, where they are requested. */
static kempe_status kempe_contacts_rows(const cli_job *j, const void *contacts, bool drawn, kempe_table **table)
{
    (void)drawn;
    return kempe_contacts_table(contacts, j->settings->contact.conicity ? "conicity" : "rows", table);
}

WRITER(kempe_contacts_write_picture)

STUDY(contact, kempe_contacts, kempe_contacts_new(j->system, &s->contact, result), .table = kempe_contacts_rows,
      .files = {{AT(svg), any_kempe_contacts_write_picture}})
