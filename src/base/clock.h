/* SPDX-License-Identifier: BSD-3-Clause */
#pragma once

/** Seconds of processor time of this thread, from some beginning. */
double kmp_cpu_now(void);

/** Seconds on the wall, from some beginning; they never go back. */
double kmp_wall_now(void);
