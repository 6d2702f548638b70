/* SPDX-License-Identifier: BSD-3-Clause */
/* An XML document as a tree of elements with their places: a thin layer that hides Expat. Attributes are elements
 * too, comments and the blanks around a text are gone. */
#ifndef KMP_MODEL_FILES_XML_H
#define KMP_MODEL_FILES_XML_H

#include "base/arena.h"
#include "base/context.h"
#include "model/model.h"

typedef struct kmp_element {
    const char *name;
    kmp_place place;
    const char *text; /* "" when it has none */
    kmp_place text_place;
    struct kmp_element *first, *last, *next; /* elements inside, the next one beside it */
} kmp_element;

/** Reads `text`, without what elements of the names `skipped` (NULL ends them) hold. `*root` lives in `arena` and is
 *  untouched on failure. `number` is that of the file in the places of its elements. A document type is refused, and
 *  with it all entities but the five of XML. */
kempe_status kmp_xml_load(kempe_context *context, kmp_arena *arena, const char *file, int number, const char *text,
                          size_t length, const char *const *skipped, const kmp_element **root);

/** The first element of a name inside `element`, NULL when there is none (or no `element`). */
const kmp_element *kmp_element_find(const kmp_element *element, const char *name);

/** The next one of the same name beside it. */
const kmp_element *kmp_element_again(const kmp_element *element);

/** Its text, NULL where it is absent or has none. */
const char *kmp_element_text(const kmp_element *element, const char *name);

#endif
