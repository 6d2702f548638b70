/* SPDX-License-Identifier: BSD-3-Clause */
#include "cli/command.h"
#include <kempe/contact_table.h>

static bool says_over_what(const cli_settings *s)
{
    if (!s->contact.sweep)
        cli_complain("the sweep is missing: --sweep NAME=A:B:N of a coordinate or parameter, for example the lateral "
                     "position of the wheels, --sweep 'y=0:-6 mm:13'; 'kempe check FILE' lists the coordinates");
    return s->contact.sweep;
}

static kempe_status print_table(const void *object, kempe_format format, char **text)
{
    return kempe_contact_table_print(object, format, text);
}

static kempe_status contact(const cli_job *j)
{
    const cli_settings *s = j->settings;
    kempe_contact_options ask = s->contact;
    kempe_contact_table *table = NULL;
    kempe_status status = kempe_contact_table_new(j->system, &ask, &table);
    cli_tell_failure(j, status, table != NULL);
    if (table) {
        status = cli_worse(status, cli_report(j, print_table, table));
        if (s->output)
            status = cli_worse(status, cli_tell_written(j, kempe_contact_table_write_csv(table, s->output)));
        if (s->svg)
            status = cli_worse(status, cli_tell_written(j, kempe_contact_table_write_svg(table, s->svg)));
    }
    kempe_contact_table_free(table);
    return status;
}

const cli_command cli_contact = {
    .bit = CLI_CONTACT,
    .name = "contact",
    .usage = "FILE --sweep NAME=A:B:N[,NAME=A:B..] [options]",
    .summary = "wheel-rail contact table: contact positions, creepages and forces over a sweep",
    .examples = "  kempe contact examples/manchester/manchester.yaml --sweep \"shift=0:10 mm:21\"\n"
                "  kempe contact examples/manchester/manchester.yaml --sweep \"shift=0:10 mm:21\" --law fastsim --svg "
                "contact.svg\n",
    .accepts = says_over_what,
    .dynamics = "plain",
    .run = contact,
};
