/* SPDX-License-Identifier: BSD-3-Clause */
/* Whether a test takes every case, or the sample that is enough for ./check. */
#ifndef KEMPE_TESTS_FULL_H
#define KEMPE_TESTS_FULL_H

#include <stdbool.h>
#include <stdlib.h>

/* `./check full` sets KEMPE_FULL. */
static inline bool check_full(void)
{
    return getenv("KEMPE_FULL") != NULL;
}

#endif
