/* SPDX-License-Identifier: BSD-3-Clause */
/* Store of derived equations, by name: made once and used by all runs of a system, as long as the system lasts. Bytes
 * of them are kept in the context's cache if there is one. */
#pragma once

#include "base/cache/bytes.h"
#include "base/cache/cache_files.h"
#include "dynamics/system.h"

/** The name of kept bytes: the word of what they are, a number that distinguishes several, and a digest of the choice
 * that they were made for (zero: of none). Bytes of a choice depend on programs of the system, and not on the numbers
 * of the model. */
typedef struct kmp_program_cache_name {
    const char *what;
    unsigned variant;
    kmp_cache_key choice;
} kmp_program_cache_name;

/** Objects made for choices that a system keeps at most: the next ones are not kept. */
enum { KMP_KEPT_CHOICES = 32 };

/** Room for kept bytes; NULL: no memory. */
kmp_program_cache *kmp_program_cache_new(void);
void kmp_program_cache_free(kmp_program_cache *kept);
/** Forgets what was derived with other numbers of the model: all but what was made for a choice. */
void kmp_program_cache_clear(kmp_program_cache *kept);

/** The object that is kept by a name; NULL: there is none. Several threads may ask. */
const void *kmp_program_cache_find(const kempe_system *system, kmp_program_cache_name name);

/** Takes what was made; `release` frees it. Returns what is kept by the name: another thread may have added it before.
 * NULL: no memory or too many choices, and it is freed. */
const void *kmp_program_cache_add(const kempe_system *system, kmp_program_cache_name name, void *made,
                                  void (*release)(void *made));

/** True if the system may keep what is made for another choice. */
bool kmp_program_cache_has_room(const kempe_system *system);

/** kmp_program_cache_recall: the bytes that the cache of the system's context has for its key, in room for the caller
 * to free with kmp_free. kmp_program_cache_write: writes such bytes. The system needs a key. */
kmp_cached kmp_program_cache_recall(const kempe_system *system, kmp_program_cache_name name);
void kmp_program_cache_write(const kempe_system *system, kmp_program_cache_name name, const kmp_bytes *bytes);

/** Lets machine code of a program of the system be kept, by a name of the program (NULL: there is none). */
void kmp_program_cache_name_program(const kempe_system *system, kmp_program_cache_name name, kmp_program *program);

/** Sets the key of a system: its model, the algorithm (NULL: the model's), this build and processor. None without a
 * cache. */
void kmp_program_cache_set_key(kempe_system *system, const char *algorithm);
