/* SPDX-License-Identifier: BSD-3-Clause */
#ifndef KMP_BASE_CLOCK_H
#define KMP_BASE_CLOCK_H

/** Seconds of processor time of this thread, from some beginning. */
double kmp_cpu_now(void);

/** Seconds on the wall, from some beginning; they never go back. */
double kmp_wall_now(void);

#endif
