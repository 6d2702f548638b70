/* SPDX-License-Identifier: BSD-3-Clause */
/* Tests take every case or a sample: ./check takes samples. */
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
