/* SPDX-License-Identifier: BSD-3-Clause */
#include "backend/prepared.h"
#include "base/memory.h"
#include <string.h>

/* Operations of a program whose code is kept: smaller ones are written in less time than a file is read. */
enum { LEAST_KEPT = 3000 };

static void release(kmp_program_form *form)
{
    kmp_prepared *prepared = (kmp_prepared *)form;
    kmp_frame_free(&prepared->frame);
    kmp_code_free(&prepared->code);
    kmp_free(prepared);
}

/* -- writing ----------------------------------------------------------------------------------------- */

static bool write_code(kmp_prepared *prepared, const kmp_program *program, kmp_x86_form form, int threads)
{
    kmp_layout layout = {0};
    kmp_code *code = &prepared->code;
    bool ok =
        kmp_layout_init(&layout, &prepared->frame, program, kmp_code_is_straight, 0, &kmp_backend_native, threads) &&
        kmp_code_list(code, &layout) && kmp_code_write(code, &layout, form);
    kmp_layout_free(&layout);
    kmp_arena_free(&code->list);
    return ok;
}

static bool is_zero(double value)
{
    uint64_t bits;
    memcpy(&bits, &value, sizeof bits);
    return bits == 0;
}

bool kmp_prepared_take_start(kmp_prepared *prepared)
{
    kmp_frame *f = &prepared->frame;
    uint32_t count = 0;
    for (uint32_t k = 0; k < f->slots; k++)
        count += !is_zero(f->v[k]);
    prepared->start = KMP_ARENA_NEW(&f->arena, kmp_slot_start, count);
    for (uint32_t k = 0; prepared->start && k < f->slots; k++)
        if (!is_zero(f->v[k]))
            prepared->start[prepared->start_count++] = (kmp_slot_start){f->v[k], k};
    kmp_arena_free(&f->values);
    f->v = NULL;
    return prepared->start;
}

/* -- the cache --------------------------------------------------------------------------------------- */

static void keep(kmp_prepared *prepared, const char *folder, const kmp_cache_key *key)
{
    kmp_bytes bytes = {0};
    if (!prepared->code.pages)
        return;
    kmp_prepared_put(&bytes, prepared);
    if (!bytes.failed)
        kmp_cache_write(folder, key, bytes.at, bytes.size, KMP_CACHE_BYTES);
    kmp_bytes_free(&bytes);
}

static bool recall(kmp_prepared *prepared, const kmp_program *program, const char *folder, const kmp_cache_key *key)
{
    kmp_cached file = kmp_cache_read(folder, key);
    kmp_byte_source source = kmp_byte_source_of(file.bytes, file.size);
    bool good = file.whole && kmp_prepared_take(&source, program, prepared);
    kmp_free(file.whole);
    return good;
}

/* -- one for all ------------------------------------------------------------------------------------- */

static kmp_prepared *new_prepared(int kind)
{
    kmp_prepared *prepared = KMP_NEW(kmp_prepared, 1);
    if (prepared)
        prepared->form = (kmp_program_form){.kind = kind, .release = release};
    return prepared;
}

/* The folder and the key of a program's code; NULL: it is not kept. */
static const char *folder_of(const kmp_program *program, int kind, kmp_cache_key *key)
{
    return program->code[program->stages] < LEAST_KEPT ? NULL : kmp_program_folder(program, kind, key);
}

static kmp_prepared *make(const kmp_program *program, kmp_x86_form form, int threads)
{
    kmp_cache_key key;
    int kind = kmp_prepared_kind(form, threads);
    const char *folder = folder_of(program, kind, &key);
    kmp_prepared *prepared = new_prepared(kind);
    if (!prepared)
        return NULL;
    if (!write_code(prepared, program, form, threads) || !kmp_prepared_take_start(prepared)) {
        release(&prepared->form);
        return NULL;
    }
    if (folder)
        keep(prepared, folder, &key);
    return prepared;
}

/* That of the cache; NULL: none. */
static kmp_prepared *recalled(const kmp_program *program, int kind)
{
    kmp_cache_key key;
    const char *folder = folder_of(program, kind, &key);
    kmp_prepared *prepared = folder ? new_prepared(kind) : NULL;
    if (!prepared || recall(prepared, program, folder, &key))
        return prepared;
    release(&prepared->form);
    return NULL;
}

const kmp_prepared *kmp_prepared_known(const kmp_program *program, kmp_x86_form form, int threads)
{
    int kind = kmp_prepared_kind(form, threads);
    kmp_program_form *found = kmp_program_find_form(program, kind);
    if (found)
        return (const kmp_prepared *)found;
    kmp_prepared *made = recalled(program, kind);
    return made ? (const kmp_prepared *)kmp_program_add_form(program, &made->form) : NULL;
}

const kmp_prepared *kmp_prepared_of(const kmp_program *program, kmp_x86_form form, int threads)
{
    const kmp_prepared *known = kmp_prepared_known(program, form, threads);
    kmp_prepared *made = known ? NULL : make(program, form, threads);
    return made ? (const kmp_prepared *)kmp_program_add_form(program, &made->form) : known;
}

bool kmp_prepared_frame(const kmp_prepared *prepared, kmp_frame *frame, kmp_team *team)
{
    *frame = prepared->frame;
    frame->team = team;
    frame->arena = frame->values = (kmp_arena){0};
    frame->v = NULL;
    frame->solving = NULL;
    return kmp_frame_add_blocks(frame);
}

bool kmp_prepared_values(const kmp_prepared *prepared, kmp_frame *frame)
{
    frame->v = kmp_arena_aligned(&frame->values, frame->slots);
    for (uint32_t k = 0; frame->v && k < prepared->start_count; k++)
        frame->v[prepared->start[k].slot] = prepared->start[k].value;
    return frame->v;
}
