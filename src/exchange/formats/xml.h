/* SPDX-License-Identifier: BSD-3-Clause */
/* An XML document as a tree of elements with their places: a thin layer that hides Expat. Attributes are elements too;
 * comments and the blanks around a text are removed. */
#pragma once

#include "base/arena.h"
#include "base/context.h"
#include "model/data/place.h"
#include <kempe/kempe.h>
#include <stdbool.h>

typedef struct kmp_element {
    const char *name;
    kmp_place place;
    const char *text; /* "" when it has none */
    kmp_place text_place;
    struct kmp_element *first, *last, *next; /* child elements, the next sibling */
} kmp_element;

/** Reads `text`, without the contents of elements named in `skipped` (NULL ends the list). `*root` lives in `arena` and
 * is untouched on failure. `number` is the file's number in the places of its elements. A document type is rejected,
 * and with it all entities but the five of XML. */
kempe_status kmp_xml_load(kempe_context *context, kmp_arena *arena, const char *file, int number, const char *text,
                          size_t length, const char *const *skipped, const kmp_element **root);

/** The first element of a name inside `element`, NULL when there is none (or no `element`). */
const kmp_element *kmp_element_find(const kmp_element *element, const char *name);

/** The next sibling of the same name. */
const kmp_element *kmp_element_again(const kmp_element *element);

/** The child element with a name whose own child `key` has a text, NULL when there is none. */
const kmp_element *kmp_element_named(const kmp_element *element, const char *name, const char *key, const char *text);

/** The text of a child, NULL where it is absent or has none. */
const char *kmp_element_text(const kmp_element *element, const char *name);

/** True if a child says yes, or no, as a word or number. */
bool kmp_element_says(const kmp_element *element, const char *name, bool yes);
