/* SPDX-License-Identifier: BSD-3-Clause */
/* Expat's events become elements in an arena. Nothing recurses here, but functions that traverse the tree may: its
 * depth is limited. */
#include "exchange/formats/xml.h"
#include "base/memory.h"
#include "model/language/limits.h"
#include <expat.h>
#include <string.h>

enum { CHUNK = 1 << 20 };

typedef struct loader {
    kempe_context *context;
    kmp_arena *arena;
    const char *file;
    int number; /* of the file, for places */
    const char *const *skipped;
    XML_Parser parser;
    kmp_element *open[KMP_MOST_ELEMENTS]; /* from the root to where we are */
    int depth;
    int ignored; /* levels inside a skipped element */
    kmp_element *root;
    kmp_text text; /* of the innermost open element, while it has no child */
    kmp_place text_place;
    kempe_status status;
} loader;

static const char blanks[] = " \t\r\n";

static kmp_place here(const loader *l)
{
    return (kmp_place){.line = (int)XML_GetCurrentLineNumber(l->parser),
                       .column = (int)XML_GetCurrentColumnNumber(l->parser) + 1,
                       .file = l->number};
}

static void refuse(loader *l, const char *sentence)
{
    kmp_place place = here(l);
    l->status = kmp_complain(l->context, l->file, place.line, place.column, "XML: %s", sentence);
    (void)XML_StopParser(l->parser, XML_FALSE);
}

/* -- memory ---------------------------------------------------------------------------------------- */

static void *allocate(size_t size)
{
    return kmp_realloc(NULL, size, 1);
}

static void *grow(void *old, size_t size)
{
    return kmp_realloc(old, size, 1);
}

/* -- elements -------------------------------------------------------------------------------------- */

static kmp_element *new_element(loader *l, const char *name)
{
    kmp_element *e = KMP_ARENA_NEW(l->arena, kmp_element, 1);
    const char *kept = kmp_arena_strdup(l->arena, name);
    if (!e || !kept)
        return NULL;
    *e = (kmp_element){.name = kept, .text = "", .place = here(l), .text_place = here(l)};
    kmp_element *parent = l->depth > 0 ? l->open[l->depth - 1] : NULL;
    if (!parent)
        l->root = e;
    else if (!parent->first)
        parent->first = parent->last = e;
    else
        parent->last = parent->last->next = e;
    return e;
}

static void set_text(loader *l, kmp_element *e, const char *text)
{
    const char *kept = kmp_arena_strdup(l->arena, text);
    if (kept)
        e->text = kept;
}

static void XMLCALL on_start(void *user, const char *name, const char **attributes)
{
    loader *l = user;
    bool skipped = l->ignored > 0;
    for (const char *const *s = l->skipped; s && *s; s++)
        skipped = skipped || strcmp(*s, name) == 0;
    if (skipped) {
        l->ignored++;
        return;
    }
    if (l->depth == KMP_MOST_ELEMENTS) {
        refuse(l, "the elements are nested too deeply");
        return;
    }
    kmp_element *e = new_element(l, name);
    if (!e) {
        (void)XML_StopParser(l->parser, XML_FALSE);
        return;
    }
    l->open[l->depth++] = e;
    for (; attributes[0]; attributes += 2) {
        kmp_element *attribute = new_element(l, attributes[0]);
        if (strlen(attributes[1]) > KMP_MOST_ATTRIBUTE) {
            refuse(l, "an attribute has more than a million characters");
            return;
        }
        if (attribute)
            set_text(l, attribute, attributes[1]);
    }
    kmp_text_free(&l->text);
}

/* Blanks at its end are cut off; blanks at its beginning have not been taken. */
static void XMLCALL on_end(void *user, const char *name)
{
    (void)name;
    loader *l = user;
    if (l->ignored) {
        l->ignored--;
        return;
    }
    kmp_element *e = l->open[--l->depth];
    if (l->text.failed) {
        l->arena->failed = true;
    } else if (l->text.length > 0) {
        size_t length = l->text.length;
        while (strchr(blanks, l->text.s[length - 1]))
            length--;
        l->text.s[length] = '\0';
        set_text(l, e, l->text.s);
        e->text_place = l->text_place;
    }
    kmp_text_free(&l->text);
}

/* A line comes in one piece or several, its end apart. */
static void XMLCALL on_text(void *user, const char *s, int length)
{
    loader *l = user;
    if (l->ignored)
        return;
    int blank = 0;
    while (l->text.length == 0 && blank < length && strchr(blanks, s[blank]))
        blank++;
    if (blank == length)
        return;
    if (l->text.length == 0) {
        l->text_place = here(l);
        l->text_place.column += blank;
    }
    kmp_text_printf(&l->text, "%.*s", length - blank, s + blank);
}

static void XMLCALL on_document_type(void *user, const char *name, const char *system, const char *public_id,
                                     int inside)
{
    (void)name, (void)system, (void)public_id, (void)inside;
    refuse(user, "a model cannot have a document type");
}

/* -- documents ------------------------------------------------------------------------------------- */

static void parse(loader *l, const char *text, size_t length)
{
    bool last = false;
    for (size_t at = 0; !last; at += CHUNK) {
        last = length - at <= CHUNK;
        if (XML_Parse(l->parser, text + at, last ? (int)(length - at) : CHUNK, last) == XML_STATUS_ERROR) {
            enum XML_Error error = XML_GetErrorCode(l->parser);
            if (l->status == KEMPE_OK) {
                if (error == XML_ERROR_NO_MEMORY || l->arena->failed)
                    l->status = kmp_fail_memory(l->context);
                else
                    refuse(l, XML_ErrorString(error));
            }
            return;
        }
    }
}

kempe_status kmp_xml_load(kempe_context *context, kmp_arena *arena, const char *file, int number, const char *text,
                          size_t length, const char *const *skipped, const kmp_element **root)
{
    static const XML_Memory_Handling_Suite memory = {allocate, grow, kmp_free};
    loader l = {.context = context, .arena = arena, .file = file, .number = number, .skipped = skipped};
    l.parser = XML_ParserCreate_MM(NULL, &memory, NULL);
    KMP_TRY(kmp_made(context, l.parser));
    XML_SetUserData(l.parser, &l);
    XML_SetElementHandler(l.parser, on_start, on_end);
    XML_SetCharacterDataHandler(l.parser, on_text);
    XML_SetStartDoctypeDeclHandler(l.parser, on_document_type);
    parse(&l, text, length);
    XML_ParserFree(l.parser);
    kmp_text_free(&l.text);
    if (l.status == KEMPE_OK && arena->failed)
        l.status = kmp_fail_memory(context);
    if (l.status == KEMPE_OK)
        *root = l.root;
    return l.status;
}

const kmp_element *kmp_element_find(const kmp_element *element, const char *name)
{
    const kmp_element *e = element ? element->first : NULL;
    while (e && strcmp(e->name, name) != 0)
        e = e->next;
    return e;
}

const kmp_element *kmp_element_again(const kmp_element *element)
{
    const kmp_element *e = element->next;
    while (e && strcmp(e->name, element->name) != 0)
        e = e->next;
    return e;
}

const char *kmp_element_text(const kmp_element *element, const char *name)
{
    const kmp_element *e = kmp_element_find(element, name);
    return e && e->text[0] ? e->text : NULL;
}

const kmp_element *kmp_element_named(const kmp_element *element, const char *name, const char *key, const char *text)
{
    const kmp_element *e = kmp_element_find(element, name);
    for (; e; e = kmp_element_again(e)) {
        const char *own = kmp_element_text(e, key);
        if (own && strcmp(own, text) == 0)
            break;
    }
    return e;
}

bool kmp_element_says(const kmp_element *element, const char *name, bool yes)
{
    const char *text = kmp_element_text(element, name);
    return text && (strcmp(text, yes ? "true" : "false") == 0 || strcmp(text, yes ? "1" : "0") == 0);
}
