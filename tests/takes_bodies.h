/* SPDX-License-Identifier: BSD-3-Clause */
/* True if runs of a system may go by articulated bodies. */
#ifndef KEMPE_TESTS_TAKES_BODIES_H
#define KEMPE_TESTS_TAKES_BODIES_H

#include "dynamics/motion.h"
#include "testing.h"

static inline bool takes_bodies(const kempe_system *system)
{
    CHECK(system && kmp_motion_need_bodies(system) == KEMPE_OK);
    return system && system->bodies->program;
}

#endif
