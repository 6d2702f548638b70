/* SPDX-License-Identifier: BSD-3-Clause */
#ifndef KEMPE_TESTS_SANITIZED_H
#define KEMPE_TESTS_SANITIZED_H

/* SANITIZED: the program is built with a sanitizer. */
#if defined(__has_feature)
#if __has_feature(address_sanitizer) || __has_feature(memory_sanitizer) || __has_feature(thread_sanitizer)
#define SANITIZED
#endif
#endif
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
#define SANITIZED
#endif

#endif
