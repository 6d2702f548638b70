/* SPDX-License-Identifier: BSD-3-Clause */
/* Settings of the whole process, which belong to a program and not to a library. They save time and change no result.
 */
#pragma once

/** Keeps memory that is freed, takes large pages for it, and ends threads that wait for work of BLAS. */
void cli_own_process(void);
