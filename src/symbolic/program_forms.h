/* SPDX-License-Identifier: BSD-3-Clause */
/* Forms of a program, such as machine code: each is made once for all threads that run the program, and lives as long.
 */
#pragma once

#include "base/cache/cache_files.h"
#include "symbolic/program.h"
#include <stdatomic.h>

/** The first member of what is made. */
typedef struct kmp_program_form {
    struct kmp_program_form *next;
    int kind; /* distinguishes several of one program */
    void (*release)(struct kmp_program_form *form);
} kmp_program_form;

/** A program's holders, its forms, and where bytes of them may be kept. */
typedef struct kmp_program_shared {
    atomic_int others; /* further holders after the first */
    _Atomic(kmp_program_form *) first;
    const kempe_context *context; /* outlives the program; NULL: nothing is kept */
    kmp_cache_key key;
} kmp_program_shared;

/** Another holder of the program, which the last kmp_program_free ends. */
kmp_program *kmp_program_share(kmp_program *p);

/** The form of a kind; NULL: there is none yet. */
kmp_program_form *kmp_program_find_form(const kmp_program *p, int kind);
/** Gives a form to the program. Returns the one to use: the form that another thread gave before, if any. */
kmp_program_form *kmp_program_add_form(const kmp_program *p, kmp_program_form *form);

/** For kmp_program_free: false if other holders remain; otherwise all forms are released. */
bool kmp_program_leave(kmp_program *p);

/** Lets bytes of forms be kept in the context's cache, under keys that differ from this one. */
void kmp_program_set_key(kmp_program *p, const kempe_context *context, const kmp_cache_key *key);

/** The folder and the key for bytes of a kind. NULL: they are not kept. */
const char *kmp_program_folder(const kmp_program *p, int kind, kmp_cache_key *key);
