/* SPDX-License-Identifier: BSD-3-Clause */
#include "base/wings.h"
#include "road/model/read_tyres.h"
#include "road/model/write_tyres.h"
#include "road/tyre/tyre_contact.h"

static const char *const sections[] = {"roads", "tyres", NULL};

static void read_sections(kmp_reader *r, kmp_reader_stage stage)
{
    if (stage == KMP_READ_WITH_STATES)
        kmp_read_tyres(r);
    else if (stage == KMP_READ_AFTER_FORCES)
        kmp_add_tyre_forces(r);
}

static const kmp_reader_wing reader = {sections, read_sections};

const kmp_wing kmp_wing_road = {
    .name = "road",
    .reader = &reader,
    .writer = kmp_tyre_writer,
    .laws = kmp_tyre_laws,
    .outputs = kmp_tyre_outputs,
};
