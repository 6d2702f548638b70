/* SPDX-License-Identifier: BSD-3-Clause */
/* The line and the column of an element of a model. */
#pragma once

/** The place of an element, for later messages. */
typedef struct kmp_place {
    int line, column;
    int file; /* of the model's files */
} kmp_place;
