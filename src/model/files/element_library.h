/* SPDX-License-Identifier: BSD-3-Clause */
/* The library of machine elements: model files with ports that are part of Kempe itself. Their source is the folder
 * `elements`; a model includes one as `kempe:NAME.yaml`. */
#pragma once

#include "base/context.h"
#include <stdbool.h>

typedef struct kmp_machine_element {
    const char *name;         /* "kempe:gas_spring.yaml" */
    const char *const *lines; /* of its text; NULL ends them */
} kmp_machine_element;

/** In the order of their names; a row without a name ends them. Written by CMake. */
extern const kmp_machine_element kmp_elements[];

/** True for the name of a file of the library, `kempe:NAME.yaml`, whether or not there is one. */
bool kmp_is_element(const char *path);

/** The text of an element (free with kmp_free). KEMPE_E_IO: the library has none of this name. */
kempe_status kmp_element_read(kempe_context *context, const char *path, char **text, size_t *length);
