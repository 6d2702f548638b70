/* SPDX-License-Identifier: BSD-3-Clause */
#include "workbench/served_file.h"
#include "base/file.h"
#include "base/memory.h"
#include <string.h>
#include <time.h>

/* A change within this time of the last one may have left no other time of change. */
enum { YOUNG_S = 2 };

static bool is_same_state(const kmp_path_state *a, const kmp_path_state *b)
{
    return a->number == b->number && a->device == b->device && a->size == b->size && a->changed == b->changed &&
           a->changed_ns == b->changed_ns;
}

/* Text of JSON: without zeros, and in UTF-8. */
static bool is_text(const char *text, size_t length)
{
    int size;
    unsigned code;
    if (strlen(text) != length)
        return false;
    for (const char *at = text; (at = kmp_text_unfit(at, &size, &code)); at += size)
        if (code == 0 || (unsigned char)*at >= 0x80) /* control characters are a matter of the reader */
            return false;
    return true;
}

/* Takes the text on disk, with the lock. KEMPE_E_IO with the message in the file's context. */
static kempe_status take_text(kmp_served_file *f)
{
    kmp_path_state state;
    char *text;
    size_t length;
    const bool seen = kmp_path_look(f->path, &state), back = f->gone && seen;
    f->gone = !seen;
    if (seen && !back && f->text && is_same_state(&state, &f->state) && time(NULL) - state.changed > YOUNG_S)
        return KEMPE_OK;
    kmp_context_clear(f->context);
    KMP_TRY(kmp_file_read(f->context, KMP_FILE_MODEL, f->path, &text, &length));
    if (!is_text(text, length)) {
        kmp_free(text);
        return kmp_fail(f->context, KEMPE_E_IO, "'%s' is not a text in UTF-8", f->name);
    }
    f->state = state;
    if (!back && f->text && f->length == length && memcmp(f->text, text, length) == 0) {
        kmp_free(text);
        return KEMPE_OK;
    }
    kmp_free(f->text);
    f->text = text;
    f->length = length;
    f->version++;
    return KEMPE_OK;
}

kempe_status kmp_served_file_init(kmp_served_file *f, kempe_context *context, const char *path)
{
    *f = (kmp_served_file){.context = kempe_context_new()};
    (void)pthread_mutex_init(&f->lock, NULL);
    KMP_TRY(kmp_made(context, f->context));
    if (!kmp_path_real(path, f->path))
        (void)snprintf(f->path, sizeof f->path, "%s", path); /* reading it has the reason */
    f->name = kmp_path_name(f->path);
    (void)snprintf(f->folder, sizeof f->folder, "%.*s", (int)kmp_path_folder(f->path), f->path);
    kempe_status status = take_text(f);
    return status == KEMPE_OK ? status : kmp_fail(context, status, "%s", kempe_context_message(f->context));
}

void kmp_served_file_free(kmp_served_file *f)
{
    kmp_free(f->text);
    kempe_context_free(f->context);
    (void)pthread_mutex_destroy(&f->lock);
    *f = (kmp_served_file){0};
}

long kmp_served_file_look(kmp_served_file *f, kmp_text *why)
{
    (void)pthread_mutex_lock(&f->lock);
    const kempe_status status = take_text(f);
    const long version = status == KEMPE_OK ? f->version : 0;
    if (status != KEMPE_OK)
        kmp_text_put(why, kempe_context_message(f->context));
    (void)pthread_mutex_unlock(&f->lock);
    return version;
}

void kmp_served_file_put(kmp_served_file *f, kmp_text *out)
{
    kmp_json json = kmp_json_begin_as(out, KMP_JSON_DENSE);
    (void)pthread_mutex_lock(&f->lock);
    kmp_json_object(&json, NULL);
    kmp_json_string(&json, "name", f->name);
    kmp_json_string(&json, "path", f->path);
    kmp_json_string(&json, "text", f->text);
    kmp_json_whole(&json, "version", f->version);
    kmp_json_end(&json);
    (void)pthread_mutex_unlock(&f->lock);
}

/* The file was removed from its folder, which is still there and is not a link now. */
static bool is_removed(const kmp_served_file *f)
{
    char real[KMP_PATH_MOST];
    const bool found = f->gone && f->text && kmp_path_real(f->folder, real);
    const size_t length = found ? strlen(real) : 0;
    return found && strncmp(real, f->folder, length) == 0 && strlen(f->folder) <= length + 1;
}

bool kmp_served_file_write(kmp_served_file *f, const char *text, long *version, kmp_text *why)
{
    (void)pthread_mutex_lock(&f->lock);
    kempe_status status = take_text(f);
    bool written = (status == KEMPE_OK || is_removed(f)) && f->version == *version;
    if (written)
        status = kempe_write_file(f->context, f->path, text);
    if (written && status == KEMPE_OK)
        status = take_text(f);
    if (status != KEMPE_OK)
        kmp_text_put(why, kempe_context_message(f->context));
    written = written && status == KEMPE_OK;
    *version = f->version;
    (void)pthread_mutex_unlock(&f->lock);
    return written;
}
