/* SPDX-License-Identifier: BSD-3-Clause */
/* Memory for machine code: written first, executable after, never both. */
#ifndef KMP_BACKEND_X86_PAGES_H
#define KMP_BACKEND_X86_PAGES_H

#include <stddef.h>

/** A copy of the code that can be run; NULL where the system does not allow it. */
void *kmp_pages_new(const void *code, size_t size);
void kmp_pages_free(void *pages, size_t size);

#endif
