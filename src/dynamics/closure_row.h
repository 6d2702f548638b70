/* SPDX-License-Identifier: BSD-3-Clause */
#pragma once

/** A closure row that is kept. */
typedef struct kmp_row {
    int closure, component; /* component: of the declared rows, from 0 */
    int number;             /* among the closure's kept rows, from 0: the k of lambda.CLOSURE.k, less one */
    int length_power;
    int of_rates; /* 1: its h is zero everywhere, and its rate is not the rate of any function of the coordinates */
} kmp_row;
