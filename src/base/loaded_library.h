/* SPDX-License-Identifier: BSD-3-Clause */
/* A shared library that is loaded at its first use, with the functions that are called in it. */
#pragma once

#include <stdbool.h>
#include <stddef.h>

/** `addresses` is an array, or a structure, of as many pointers to functions as there are names. They are valid where
 * the library has all functions. */
typedef struct kmp_loaded_library {
    const char *name;
    const char *const *functions;
    size_t count;
    void *addresses;
    bool tried;
    char missing[200];
} kmp_loaded_library;

#define KMP_LOADED_LIBRARY(NAME, FUNCTIONS, ADDRESSES)                                                                 \
    {                                                                                                                  \
        .name = (NAME), .functions = (FUNCTIONS), .count = sizeof(FUNCTIONS) / sizeof *(FUNCTIONS),                    \
        .addresses = (ADDRESSES)                                                                                       \
    }

/** Loads the library once. NULL: all its functions are there; else the reason of the system. Any thread may call. */
const char *kmp_library_missing(kmp_loaded_library *library);
